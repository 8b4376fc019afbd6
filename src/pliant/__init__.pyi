from . import errors as errors
from .errors import MeshError as MeshError
from .errors import PliantError as PliantError
from .mesh import Curvatures as Curvatures
from .mesh import Mesh as Mesh
from .mesh import principal_curvatures as principal_curvatures
from .mesh import shapes as shapes
from .spectral import Laplacian as Laplacian
from .spectral import Spectrum as Spectrum
from .spectral import eigenbasis as eigenbasis
from .spectral import laplacian as laplacian

__version__: str
