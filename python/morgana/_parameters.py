"""Parameters of a scene by name."""

from __future__ import annotations

import difflib
from typing import Any, Dict, Iterator, List, Mapping, Optional, Tuple

import numpy as np

from . import _morgana
from ._morgana import Scene

Row = Tuple[str, str, Any, bool]


class Parameters(Mapping[str, Any]):
    """Parameters of a scene by name, with values that can be replaced.

    Made by :meth:`morgana.Scene.parameters`. Assign values, then call :meth:`update` for the scene
    with these values. Printing shows a table of all names, types and values.

    An object is named by its id, which is its key in a dictionary. An object without an id is named
    by the object around it and its role or kind: ``ball.bsdf``. Values are numbers, texts, NumPy
    arrays, and arrays of three numbers for colours.

    Examples
    --------
    >>> scene = morgana.load_file("scenes/luneburg_fog.xml", width=32, height=32)
    >>> parameters = scene.parameters()
    >>> parameters["fog.sigma_t"] = 0.5
    >>> denser = parameters.update()
    """

    def __init__(self, scene: Scene) -> None:
        self._read(scene)

    def _read(self, scene: Scene) -> None:
        self._scene = scene
        self._rows: Dict[str, Row] = {row[0]: row for row in _morgana.scene_parameters(scene)}
        self._new: Dict[str, Any] = {}

    @property
    def scene(self) -> Scene:
        """The scene with the values of the last :meth:`update`."""
        return self._scene

    def __getitem__(self, name: str) -> Any:
        return self._new[name] if name in self._new else self._row(name)[2]

    def __setitem__(self, name: str, value: Any) -> None:
        """Replaces a value in the scene of the next :meth:`update`."""
        self._new[self._row(name)[0]] = value

    def __iter__(self) -> Iterator[str]:
        return iter(self._rows)

    def __len__(self) -> int:
        return len(self._rows)

    def update(self, values: Optional[Mapping[str, Any]] = None) -> Scene:
        """Return the scene with all assigned values.

        The new scene shares meshes, images and grids that do not depend on changed values with the
        old scene, and reads their files from memory. The old scene does not change. It equals the
        scene that you load with these values, and renders with the same bits.

        Parameters
        ----------
        values : mapping, optional
            Further values by name.

        Returns
        -------
        Scene
            The scene. Its warnings do not repeat warnings about shared parts.

        Raises
        ------
        SceneError
            Values of a wrong type or out of range. Places are written as
            ``parameters["ball.radius"]``. The assigned values stay assigned.
        KeyError
            An unknown name, with similar names.
        """
        for name, value in (values or {}).items():
            self[name] = value
        if self._new:
            self._read(_morgana.scene_with_values(self._scene, dict(self._new)))
        return self._scene

    def _row(self, name: str) -> Row:
        try:
            return self._rows[name]
        except (KeyError, TypeError):
            last = str(name).rsplit(".", 1)[-1]
            near = [known for known in self._rows if known.endswith("." + last)]
            near += [known for known in difflib.get_close_matches(str(name), self._rows, n=5) if known not in near]
            near = near[:5]
            hint = f"similar names are {', '.join(map(repr, near))}" if near else "print the parameters for their names"
            raise KeyError(f"the scene has no parameter {name!r}: {hint}") from None

    def _table(self) -> List[Tuple[str, str, str]]:
        def line(row: Row) -> Tuple[str, str, str]:
            name, kind, _, is_default = row
            changed = " (new)" if name in self._new else " (default)" if is_default else ""
            return name, kind, _shown(self[name]) + changed

        return [line(row) for row in self._rows.values()]

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Parameters):
            return NotImplemented
        new, others = self._new, other._new
        alike = new.keys() == others.keys() and all(np.array_equal(new[name], others[name]) for name in new)
        return self._scene == other._scene and alike

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<morgana.Parameters: {len(self)} of {self._scene!r}>"

    def __str__(self) -> str:
        rows = [("name", "type", "value"), *self._table()]
        widths = [max(len(row[i]) for row in rows) for i in range(2)]
        return "\n".join(f"{name:{widths[0]}}  {kind:{widths[1]}}  {value}" for name, kind, value in rows)

    def _repr_html_(self) -> str:
        def escaped(text: str) -> str:
            return text.replace("&", "&amp;").replace("<", "&lt;")

        cells = ("".join(f"<td>{escaped(cell)}</td>" for cell in row) for row in self._table())
        head = "<tr><th>name</th><th>type</th><th>value</th></tr>"
        return f"<table>{head}{''.join(f'<tr>{row}</tr>' for row in cells)}</table>"


def _shown(value: Any) -> str:
    """Returns a short text for a value."""
    if isinstance(value, np.ndarray) and value.size > 16:
        return f"array of shape {value.shape}"
    if isinstance(value, np.ndarray):
        return str(value.tolist())
    return repr(value) if isinstance(value, str) else str(value)


def parameters(scene: Scene) -> Parameters:
    """Returns the parameters of a scene, for its method."""
    return Parameters(scene)
