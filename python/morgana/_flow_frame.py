"""Maps between the space of a grid and the space of a mesh.

A map is the identity, or extends a plane along its normal, or revolves a half-plane."""

from __future__ import annotations

import math
from typing import Any, Optional, Tuple

import numpy as np

from numpy.typing import NDArray

from ._errors import Error

Doubles = NDArray[np.float64]

FLAT = 1e-6
"""Extent along an axis, relative to the largest extent, below which a mesh is planar."""

GOLDEN_ANGLE = math.pi * (3 - math.sqrt(5))
"""Angle whose multiples are evenly distributed over a turn."""
MAX_ANGLE = math.radians(10)
"""Half angle of the widest wedge about an axis."""
INSIDE = 1e-6
"""Fraction of the angle of a wedge by which points in its face are moved inside."""


class FlowError(Error):
    """A mesh that cannot be sampled.

    It lacks the named array or an extent, or the grid is too fine."""


class Frame:
    """Space of the grid that samples a mesh: the space of the mesh itself."""

    def __init__(self, mesh: Any) -> None:
        self.low, self.high = np.array(mesh.bounds, float).reshape(3, 2).T.copy()

    def of(self, places: Doubles) -> Doubles:
        """Converts positions in the space of the grid to positions in the mesh."""
        return places

    def points(self, points: Doubles) -> Doubles:
        """Converts points of the mesh to positions in the space of the grid."""
        return points


class Slab(Frame):
    """Planar mesh, extended along its normal with constant values."""

    def __init__(self, mesh: Any, flat: int, thickness: Optional[float]) -> None:
        super().__init__(mesh)
        if thickness is None or not (thickness > 0 and math.isfinite(thickness)):
            raise FlowError(f"the mesh is planar: give the thickness along {'xyz'[flat]}, > 0, or revolve an axisymmetric flow")
        self.flat, self.plane = flat, 0.5 * (self.low[flat] + self.high[flat])
        self.low[flat], self.high[flat] = self.plane - 0.5 * thickness, self.plane + 0.5 * thickness

    def of(self, places: Doubles) -> Doubles:
        """Projects places onto the plane."""
        found = places.copy()
        found[:, self.flat] = self.plane
        return found


class Revolved(Frame):
    """Half-plane that begins at an axis, or a wedge about an axis, revolved about the axis.

    Each value belongs to the radius of its place. Cells of a wedge are flat across it: the
    midpoint of two points at radius r is at r cos α. Radii of points are measured in the face of
    the wedge, radii of centres of cells in its middle plane.
    """

    def __init__(self, mesh: Any, axis: str, of_cells: bool) -> None:
        super().__init__(mesh)
        self.of_cells = of_cells
        if axis not in ("x", "y", "z"):
            raise FlowError(f"revolve is {axis!r} but must be 'x', 'y' or 'z'")
        self.axis = "xyz".index(axis)
        self.others = [i for i in range(3) if i != self.axis]
        points = np.asarray(mesh.points, float)
        self.offset, self.radial = self._half_plane(mesh, points)
        radii = self._radii(points)
        self.least, self.most = max(float(radii.min()), 0.0), float(radii.max())
        self.low[self.others], self.high[self.others] = -self.most, self.most

    def _half_plane(self, mesh: Any, points: Doubles) -> Tuple[Doubles, Doubles]:
        """Returns the intersection of the half-plane with the axis's normal plane, and the unit
        direction of the half-plane away from the axis."""
        offset, extent = np.zeros(3), self.high - self.low
        flat = _flat_axis(mesh)
        if flat == self.axis:
            raise FlowError(f"the mesh is planar across {'xyz'[flat]}: revolve it about an axis in its plane")
        if flat is not None:
            radial = 3 - self.axis - flat
            offset[flat] = 0.5 * (self.low[flat] + self.high[flat])
            side = 1.0 if self.high[radial] >= -self.low[radial] else -1.0
            return offset, side * np.eye(3)[radial]
        across = points.copy()
        across[:, self.axis] = 0.0
        middle = across.mean(axis=0)
        direction = middle / (np.linalg.norm(middle) or 1.0)
        along = across @ direction
        beside = np.linalg.norm(across - along[:, None] * direction, axis=1)
        if np.any(beside > math.tan(MAX_ANGLE) * along + 1e-6 * extent.max()):
            raise FlowError("revolve needs a planar mesh, or a wedge of at most 20° about the axis: use a slice of the mesh")
        normal = np.cross(np.eye(3)[self.axis], direction)
        # Use points far from the axis, which determine the angles accurately.
        angles = np.arctan2(across @ normal, along)[along > 0.5 * along.max()]
        low, high = angles.min(), angles.max()
        angle = 0.5 * (low + high) if self.of_cells else high - INSIDE * (high - low)
        return offset, np.asarray(math.cos(angle) * direction + math.sin(angle) * normal)

    def _radii(self, points: Doubles) -> Doubles:
        across = points - self.offset
        if self.of_cells:
            return np.abs(across @ self.radial)
        return np.asarray(np.linalg.norm(across[:, self.others], axis=1))

    def of(self, places: Doubles) -> Doubles:
        """Turns places into the half-plane. Moves places on the axis and on the rim slightly
        inside."""
        radii = np.linalg.norm(places[:, self.others], axis=1)
        hair = 1e-7 * (self.most - self.least)
        radii = np.where(np.abs(radii - self.least) < hair, self.least + hair, radii)
        radii = np.where(np.abs(radii - self.most) < hair, self.most - hair, radii)
        found = self.offset + radii[:, None] * self.radial
        found[:, self.axis] = places[:, self.axis]
        return np.asarray(found)

    def points(self, points: Doubles) -> Doubles:
        """Returns points of the mesh, each turned by a different angle."""
        across = points - self.offset
        radii = np.linalg.norm(across[:, self.others], axis=1)
        angles = GOLDEN_ANGLE * np.arange(len(points))
        found = points.copy()
        found[:, self.others] = radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        return found


def frame_of(mesh: Any, revolve: Optional[str], thickness: Optional[float], of_cells: bool) -> Frame:
    """Returns the frame of a mesh with values at points or at cells."""
    if revolve is not None:
        if thickness is not None:
            raise FlowError("give revolve or thickness, not both")
        return Revolved(mesh, revolve, of_cells)
    flat = _flat_axis(mesh)
    if flat is not None:
        return Slab(mesh, flat, thickness)
    if thickness is not None:
        raise FlowError("thickness is for planar meshes, but this one has a volume")
    return Frame(mesh)


def _flat_axis(mesh: Any) -> Optional[int]:
    """Returns the axis to which a planar mesh is perpendicular."""
    low, high = np.array(mesh.bounds, float).reshape(3, 2).T
    flat = np.flatnonzero(high - low <= FLAT * (high - low).max())
    if len(flat) > 1:
        raise FlowError("the mesh is a line or a point: nothing can be interpolated")
    return int(flat[0]) if len(flat) else None
