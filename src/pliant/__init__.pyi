from . import errors as errors
from .errors import MeshError as MeshError
from .errors import PliantError as PliantError
from .mesh import Mesh as Mesh
from .mesh import shapes as shapes

__version__: str
