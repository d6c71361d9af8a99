"""The viewer's page, in a notebook or in a browser."""

from __future__ import annotations

import importlib.util
import os
import tempfile
from functools import cached_property
from typing import TYPE_CHECKING, Any, Tuple, Union

from . import _morgana
from ._errors import RenderError
from ._images import Image, write
from ._result import Result
from ._scene import Define, _defines

if TYPE_CHECKING:
    from ._widget import Widget

Shown = Union[str, "os.PathLike[str]", Result, Image]


class View:
    """A page that shows images, readings and scenes: the result of :func:`morgana.view`.

    A notebook shows the page in the output of a cell. With the package ``anywidget``, the page sends
    its requests to the kernel, so that the kernel may run on another machine (tried in JupyterLab and
    marimo). Without the package, the notebook shows ``address`` in a frame, and the kernel must run
    on the machine of the browser.
    """

    def __init__(self, viewer: _morgana.Viewer, height: int) -> None:
        self._viewer = viewer
        self._height = height

    @property
    def address(self) -> str:
        """Address of the page, with the token that every request needs.

        A server runs on this machine from the first use of the address until ``close()``, or until
        this object is deleted. Only programs on this machine reach it.
        """
        return self._viewer.address()

    @cached_property
    def widget(self) -> Widget:
        """The page as an ``anywidget.AnyWidget``, to be placed among other widgets.

        Raises
        ------
        RenderError
            The package ``anywidget`` is not installed.
        """
        try:
            from ._widget import Widget
        except ImportError as error:
            raise RenderError("a widget needs the package anywidget: pip install anywidget") from error
        return Widget(self._viewer, self._height)

    def close(self) -> None:
        """Stop the server of ``address``, if it runs."""
        self._viewer.close()

    def __repr__(self) -> str:
        return f"<morgana.View at {self.address}>"

    def _repr_mimebundle_(self, **options: Any) -> Any:
        if _is_installed("anywidget"):
            return self.widget._repr_mimebundle_(**options)
        frame = f'<iframe src="{self.address}" title="morgana" width="100%" height="{self._height}" style="border: 0"></iframe>'
        return {"text/plain": repr(self), "text/html": frame}

    def _display_(self) -> Any:
        """Return the object that marimo shows."""
        return self.widget


def _is_installed(package: str) -> bool:
    return importlib.util.find_spec(package) is not None


def view(*shown: Shown, height: int = 640, **parameters: Define) -> View:
    """Show results, images and files on a page in the browser, or in a notebook.

    The page equals the page of ``morgana view``: values with their errors, comparisons, profiles,
    slices of readings, and scenes with curved rays. It shows the state at the time of this call.

    Parameters
    ----------
    *shown : Result, Image or path_like
        Results, images, and files of images, readings of meters and other arrays (``.npz``,
        ``.npy``, ``.h5``, ``.mat``), volumes and scenes.
    height : int, optional
        Height of the page in a notebook, in pixels.
    **parameters : str, float or bool
        Values of parameters that a scene file declares.

    Returns
    -------
    View
        Object that shows the page in a notebook. Its ``address`` opens in a browser on this
        machine. Its ``widget`` is the page as an ``anywidget``.

    Raises
    ------
    FileError
        A file that cannot be read.
    SceneError
        A scene file with errors.
    RenderError
        No items to show.

    Examples
    --------
    >>> morgana.view(result, "scenes/luneburg_fog.xml")
    >>> page = morgana.view("path.exr", "bdpt.exr")
    >>> print(page.address)
    """
    if not shown:
        raise RenderError("nothing to show: give results, images or files")
    # Delete the files afterwards: the page keeps their content.
    with tempfile.TemporaryDirectory(prefix="morgana-view-") as folder:
        files = [_file(item, i, folder) for i, item in enumerate(shown)]
        return View(_morgana.Viewer(files, _defines(parameters)), height)


def _file(item: Shown, number: int, folder: str) -> Tuple[str, str]:
    """Returns the name that the page shows, and the file."""
    if not isinstance(item, (Result, Image)):
        path = os.fspath(item)
        return os.path.basename(path), path
    is_measured = isinstance(item, Result) and bool(item.meters)
    path = os.path.join(folder, f"{number}.{'npz' if is_measured else 'exr'}")
    write(path, item)
    return f"{'result' if isinstance(item, Result) else 'image'} {number + 1}", path
