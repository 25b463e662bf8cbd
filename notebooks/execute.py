"""Execute lessons and exercises, each once:  python notebooks/execute.py [NOTEBOOK ...]

The executed copies are kept in ``build/executed`` and used again, by tests and book, until the notebook or the library changes. They
also show what needs no kernel: pictures made beforehand, under sliders.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import sys
import time
from pathlib import Path

import nbformat
from filelock import FileLock
from nbclient import NotebookClient
from nbformat import NotebookNode

PROJECT = Path(__file__).resolve().parents[1]
EXECUTED = PROJECT / "build" / "executed"
LESSONS = sorted((PROJECT / "notebooks").glob("[0-9][0-9]_*.ipynb"))
SOLUTIONS = sorted((PROJECT / "notebooks" / "exercises" / "solutions").glob("*.ipynb"))
STUDENT_VERSIONS = sorted((PROJECT / "notebooks" / "exercises").glob("*.ipynb"))
TIME_LIMIT = 540
""" For one cell: to catch what hangs [s] """


def executed(path: Path, *, allow_errors: bool = False) -> NotebookNode:
    """Return a notebook with its outputs; it is executed if there is no copy that is up to date.

    ``metadata.stairlab`` has the "seconds" it took and the "fingerprint" of what it depends on.

    Raises
    ------
    nbclient.exceptions.CellExecutionError
        If a cell raises an error, and errors are not allowed.
    """
    copy = EXECUTED / path.resolve().relative_to(PROJECT)
    copy.parent.mkdir(parents=True, exist_ok=True)
    fingerprint = _fingerprint(path)
    with FileLock(f"{copy}.lock"):
        if copy.is_file():
            notebook = nbformat.read(copy, as_version=4)
            if notebook.metadata.get("stairlab", {}).get("fingerprint") == fingerprint:
                return notebook
        notebook = nbformat.read(path, as_version=4)
        _compile()
        client = NotebookClient(
            notebook,
            timeout=TIME_LIMIT,
            allow_errors=allow_errors,
            resources={"metadata": {"path": str(path.parent)}},
        )
        start = time.perf_counter()
        client.execute(env=os.environ | {"STAIRLAB_BOOK": "1"})
        seconds = time.perf_counter() - start
        notebook.metadata["stairlab"] = {"seconds": round(seconds, 1), "fingerprint": fingerprint}
        nbformat.write(notebook, copy)
        return notebook


def _compile() -> None:
    """Compile the tumbling world, which is kept on disk: else the first notebook that needs it would tell its reader to wait."""
    from stairlab import TumblingWorld

    with contextlib.redirect_stderr(io.StringIO()):
        TumblingWorld().jump(50, 45)


def _fingerprint(path: Path) -> str:
    """Return a digest of all that a notebook's outputs depend on: itself, the library, the pinned packages."""
    library = sorted(
        file for file in (PROJECT / "stairlab").rglob("*") if file.is_file() and "__pycache__" not in file.parts
    )
    digest = hashlib.sha256()
    for file in [path, PROJECT / "requirements.txt", *library]:
        digest.update(str(file.resolve().relative_to(PROJECT)).encode() + b"\0" + file.read_bytes())
    return f"{digest.hexdigest()} fast={os.environ.get('STAIRLAB_FAST', '')}"


def main(paths: list[str]) -> None:
    """Execute the notebooks named, or all lessons, and say how long each took."""
    for path in [Path(name) for name in paths] or LESSONS:
        print(f"{path.name:40} {executed(path).metadata['stairlab']['seconds']:6.1f} s", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
