"""Derivatives of rays, and of the pictures that they make.

Derivatives are by the samples of a refractive index, the parameters of fields and of lenses, the
starts of the rays, and their exit plane. :class:`Screen` and :class:`Background` have derivatives
of pictures.

    >>> import morgana.grad
    >>> rays = morgana.grad.Rays(origins, directions, box=((-1, -1, -1), (1, 1, 1)), exit=morgana.grad.Plane((0, 0, 5), (0, 0, 1)))
    >>> ends = rays.forward(index)
    >>> gradient = rays.vjp(index, positions=2 * (ends.positions - measured))

See docs/guides/inverse-problems.md.
"""

from __future__ import annotations

from typing import Dict, Union

import numpy as np
from numpy.typing import NDArray

from ._bos_data import BosData
from ._camera import Camera
from ._element_array import ElementArray
from ._ends import Change, Ends, Gradient, LeastSquares
from ._morgana import Field
from ._raster import Picture, PictureGradient, PictureLoss
from ._ray_bundle import Rays
from ._screens import Background, Screen
from ._system import Aperture, Conic, Cylinder, GradError, Layout, Plane, Sphere, System

__all__ = [
    "Aperture",
    "Background",
    "BosData",
    "Camera",
    "Change",
    "Conic",
    "Cylinder",
    "ElementArray",
    "Ends",
    "GradError",
    "Gradient",
    "LeastSquares",
    "Picture",
    "PictureGradient",
    "PictureLoss",
    "Plane",
    "Rays",
    "Screen",
    "Sphere",
    "System",
    "parameters",
]

Doubles = NDArray[np.float64]


def parameters(index: Union[Field, System]) -> Dict[str, Doubles]:
    """Names and values of the parameters by which :meth:`Rays.vjp` takes derivatives.

    Parameters
    ----------
    index : Field or System
        A field, or media and surfaces.

    Returns
    -------
    dict
        Values by names, in the order of :attr:`Gradient.field`. Parameters of fields have their
        names in scenes. They are numbers and vectors of built-in fields, named numbers of formulas,
        samples of n of grids and tables, complex amplitudes (z, y, x, 2) of sampled sound, and
        ``to_world`` (3, 4). Directions of axes are unit vectors. Gases, pressures and the
        ``standard_atmosphere`` have only samples of n. Laws of dispersion have the ``value`` of n,
        or the ``factor`` on the field inside them.

    Raises
    ------
    GradError
        Media and surfaces that do not match.

    Examples
    --------
    >>> morgana.grad.parameters(morgana.load_field({"type": "luneburg"}))
    {'n_exterior': array(1.), 'center': array([0., 0., 0.]), 'radius': array(1.)}
    """
    if not isinstance(index, (Field, System)):
        raise TypeError(f"expected a Field or a System, found {type(index).__name__}")
    return Layout(index, has_box=True).parameters()
