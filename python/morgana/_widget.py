"""The viewer's page as a widget of notebooks. Needs anywidget."""

from __future__ import annotations

from typing import Any, Dict, List

import anywidget
import traitlets

from . import _morgana


class Widget(anywidget.AnyWidget):
    """The viewer's page, whose requests travel to the kernel as messages of the widget.

    Parameters
    ----------
    viewer : Viewer
        Page that answers the requests.
    height : int
        Height of the page, in pixels.
    """

    height = traitlets.Int(640).tag(sync=True)

    def __init__(self, viewer: _morgana.Viewer, height: int) -> None:
        _, _, script = viewer.respond("GET", "widget.js", b"")
        super().__init__(_esm=script.decode(), height=height)
        self._viewer = viewer
        self.on_msg(self._respond)

    def _respond(self, _widget: Any, request: Dict[str, str], _buffers: List[bytes]) -> None:
        status, kind, content = self._viewer.respond(request["method"], request["path"], request["body"].encode())
        self.send({"id": request["id"], "status": status, "kind": kind}, [content])
