from . import errors as errors
from .errors import MeshError as MeshError
from .errors import PliantError as PliantError
from .mesh import CheckUp as CheckUp
from .mesh import Curvatures as Curvatures
from .mesh import Mesh as Mesh
from .mesh import check_up as check_up
from .mesh import largest_component as largest_component
from .mesh import load_arrays as load_arrays
from .mesh import load_mesh as load_mesh
from .mesh import merged as merged
from .mesh import orient as orient
from .mesh import principal_curvatures as principal_curvatures
from .mesh import repaired as repaired
from .mesh import save_arrays as save_arrays
from .mesh import save_mesh as save_mesh
from .mesh import shapes as shapes
from .mesh import without_unreferenced as without_unreferenced
from .spectral import Laplacian as Laplacian
from .spectral import Spectrum as Spectrum
from .spectral import eigenbasis as eigenbasis
from .spectral import laplacian as laplacian

__version__: str
