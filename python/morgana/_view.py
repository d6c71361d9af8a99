"""The viewer's page, in a notebook or in a browser."""

from __future__ import annotations

import os
import tempfile
from typing import Tuple, Union

from . import _morgana
from ._errors import RenderError
from ._images import Image, write
from ._result import Result
from ._scene import Define, _defines

Shown = Union[str, "os.PathLike[str]", Result, Image]


class View:
    """A page that shows images, readings and scenes: the result of :func:`morgana.view`.

    In a notebook, this object shows the page in a frame. The page is served while this object
    exists, to programs on this machine.
    """

    address: str
    """Address of the page, with the token that every request needs."""

    def __init__(self, viewer: _morgana.Viewer, height: int) -> None:
        self.address = viewer.address
        self._viewer = viewer
        self._height = height

    def close(self) -> None:
        """Stop serving the page."""
        self._viewer.close()

    def __repr__(self) -> str:
        return f"<morgana.View at {self.address}>"

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.address}" title="morgana" width="100%" height="{self._height}" style="border: 0"></iframe>'


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
        Height of the frame in a notebook, in pixels.
    **parameters : str, float or bool
        Values of parameters that a scene file declares.

    Returns
    -------
    View
        Object that shows the page in a notebook. Its ``address`` opens in a browser on this
        machine, until ``close()`` or until the object is deleted.

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
