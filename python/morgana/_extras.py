"""Optional packages."""


def advice(extra: str) -> str:
    """Returns advice on the installation of the packages of an extra of pyproject.toml."""
    return f'run pip install ".[{extra}]" in a clone of morgana'
