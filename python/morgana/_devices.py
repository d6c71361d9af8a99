"""Graphics processors of this machine."""

from __future__ import annotations

from typing import List, NamedTuple

from . import _morgana


class Device(NamedTuple):
    """A GPU of this machine, as listed by :func:`devices`.

    Examples
    --------
    >>> morgana.devices()[0].name
    """

    name: str
    """Name of the GPU."""
    kind: str
    """``discrete``, ``integrated``, ``virtual``, ``software`` or ``other``."""
    driver: str
    """Name and version of its driver."""
    memory: int
    """Bytes of the largest buffer."""


def devices() -> List[Device]:
    """List the GPUs of this machine.

    ``morgana.render(scene, device="gpu:N")`` measures on GPU ``N`` of the list, counted from 0.

    Returns
    -------
    list of Device
        The GPUs, hardware before software. Empty if there is no GPU with a driver, or if the
        package was built without the feature ``gpu``.

    Examples
    --------
    >>> for number, device in enumerate(morgana.devices()):
    ...     print(number, device.name)
    """
    return [Device(*fields) for fields in _morgana.devices()]
