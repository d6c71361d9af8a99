"""Exceptions and messages."""

from __future__ import annotations

from typing import Iterable, List, NamedTuple, Optional, Tuple


class Diagnostic(NamedTuple):
    """A message about a scene; ``str()`` formats it like the program."""

    severity: str
    """``"error"``, ``"warning"`` or ``"note"``."""
    message: str
    """Description of the problem, in one line."""
    help: Optional[str]
    """Suggested fix."""
    where: Optional[str]
    """File, line and column, or a place in a dictionary such as ``scene["ball"]["radius"]``."""
    check: Optional[str] = None
    """Name of the check that found the problem, for ``silence`` of :func:`load_file`; ``None`` for
    errors."""

    def __str__(self) -> str:
        check = "" if self.check is None else f"[{self.check}]"
        lines = [f"{self.severity}{check}: {self.message}"]
        if self.where is not None:
            lines.append(f"  at {self.where}")
        if self.help is not None:
            lines.append(f"  help: {self.help}")
        return "\n".join(lines)


class Error(Exception):
    """Base class of all exceptions of morgana."""


class SceneError(Error, ValueError):
    """A scene that cannot be used. The text lists all errors, with places and suggestions."""

    diagnostics: List[Diagnostic]
    """All errors and warnings, one :class:`Diagnostic` each."""

    def __init__(self, diagnostics: Iterable[Tuple[str, str, Optional[str], Optional[str], Optional[str]]]) -> None:
        self.diagnostics = [Diagnostic(*fields) for fields in diagnostics]
        super().__init__("\n".join(str(d) for d in self.diagnostics))

    def __reduce__(self) -> Tuple[type, Tuple[List[Diagnostic]]]:
        return type(self), (self.diagnostics,)


class FileError(Error, OSError):
    """A file that cannot be read or written. The text names the file and the reason."""


class RenderError(Error, ValueError):
    """A render, measurement, connection or comparison that cannot be done as requested."""


class SceneWarning(UserWarning):
    """A warning about a usable scene that may not be as intended.

    ``Scene.warnings`` lists these warnings."""
