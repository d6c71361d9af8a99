"""Light along curved rays, in media of continuously varying refractive index.

    >>> import morgana
    >>> scene = morgana.load_file("scenes/luneburg_fog.xml")
    >>> result = morgana.render(scene, spp=16, progress=True)
    >>> result.image.shape, result.error.max()
    >>> morgana.write("fog.exr", result)

See docs/python.md.
"""

import importlib
import importlib.util
from typing import TYPE_CHECKING, Any, Dict, List, Optional

from . import _preview as _preview
from ._denoise import Denoised, denoise
from ._derivatives import Derivative, derivatives, jacobian
from ._devices import Device, devices
from ._errors import Diagnostic, Error, FileError, RenderError, SceneError, SceneWarning
from ._estimate import Estimate
from ._images import Difference, Image, compare, exposure, read, write
from ._layer import Layer
from ._mcx import load_mcx
from ._modulated import Modulated, ModulatedJacobian
from ._morgana import Field, Ray, Scene, __version__
from ._parameters import Parameters
from ._power import Jacobian, Power
from ._pulse import Pulse
from ._rays import Connections, Polyline, RayEnds, Rays, connect, trace
from ._reading import Reading
from ._records import Records
from ._render import render
from ._result import Result
from ._scene import export, load_dict, load_field, load_file
from ._sweep import Sweep, sweep
from ._tetrahedra import load_tetrahedra
from ._view import view

__all__ = [
    "Connections",
    "Denoised",
    "Derivative",
    "Device",
    "Diagnostic",
    "Difference",
    "Error",
    "Estimate",
    "Field",
    "FileError",
    "Image",
    "Jacobian",
    "Layer",
    "Modulated",
    "ModulatedJacobian",
    "Parameters",
    "Polyline",
    "Power",
    "Pulse",
    "Ray",
    "RayEnds",
    "Rays",
    "Reading",
    "Records",
    "RenderError",
    "Result",
    "Scene",
    "SceneError",
    "SceneWarning",
    "Sweep",
    "__version__",
    "compare",
    "connect",
    "denoise",
    "derivatives",
    "devices",
    "export",
    "exposure",
    "jacobian",
    "load_dict",
    "load_field",
    "load_file",
    "load_mcx",
    "load_tetrahedra",
    "read",
    "render",
    "sweep",
    "trace",
    "view",
    "write",
]

_MODULES: Dict[str, Optional[str]] = {
    "coherence": None,
    "correlation": None,
    "distributed": None,
    "flow": None,
    "grad": None,
    "lens": None,
    "lens_examples": None,
    "optiland": "optiland",
    "plot": "matplotlib",
    "reconstruct": None,
    "schlieren": None,
    "speckle": None,
}
"""Modules that are imported on first access, such as ``morgana.grad``, each with the package that
its import needs."""

if TYPE_CHECKING:
    from . import coherence as coherence
    from . import correlation as correlation
    from . import distributed as distributed
    from . import flow as flow
    from . import grad as grad
    from . import lens as lens
    from . import lens_examples as lens_examples
    from . import optiland as optiland
    from . import plot as plot
    from . import reconstruct as reconstruct
    from . import schlieren as schlieren
    from . import speckle as speckle
else:

    def __getattr__(name: str) -> Any:
        if name in _MODULES:
            return importlib.import_module(f".{name}", __name__)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> List[str]:
    modules = [name for name, needed in _MODULES.items() if needed is None or importlib.util.find_spec(needed)]
    return sorted({*globals(), *modules})
