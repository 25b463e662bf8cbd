"""Make the pages that come from something else: lessons with their outputs, exercises, the paper map, run times, the API reference.

They go to ``book/made``, laid out as ``notebooks/`` is, so that links between notebooks hold. A file is written only if it changed.
"""

from __future__ import annotations

import base64
import csv
import html
import re
from importlib import import_module
from importlib.metadata import distribution
from pathlib import Path

import execute
import nbformat
from nbformat import NotebookNode

import stairlab

BOOK = Path(__file__).parent
MADE = BOOK / "made"
STATIC = MADE / "static"
PAPER_MAP = BOOK / "paper_map.csv"
NOT_OURS = r"(?!stairlab\.).*"
""" Names of other packages: no inventory of theirs is fetched, so they stay without a link """
PICTURE = re.compile(r'<img alt="([^"]*)" width="(\d+)"[^>]* src="data:image/png;base64,([^"]+)">')
PLAYER = 'class="stairlab-player"'
LONG_CAPTION = 130
""" A caption that would be longer ends at its first colon """


def main(*, teachers: bool = False) -> None:
    """Make all pages; lessons that were not executed yet are executed first."""
    pages: dict[Path, str | bytes] = {}
    for path in execute.LESSONS:
        pages |= notebook_page(execute.executed(path), MADE / "course" / path.name)
    for path in execute.STUDENT_VERSIONS:
        pages |= notebook_page(read_plain(path), MADE / "course" / "exercises" / path.name)
    if teachers:
        for path in execute.SOLUTIONS:
            pages |= notebook_page(execute.executed(path), MADE / "course" / "exercises" / "solutions" / path.name)
    pages |= notebook_page(execute.executed(BOOK / "study.ipynb"), MADE / "study.ipynb")
    for path in sorted((execute.PROJECT / "notebooks").glob("*.md")):
        pages[MADE / "course" / path.name] = path.read_text(encoding="utf-8")
    pages[MADE / "paper_map.md"] = paper_map()
    pages[MADE / "run_times.md"] = run_times()
    pages |= {MADE / "api" / f"{module}.md": api_page(module, names) for module, names in api_modules().items()}
    for path, content in pages.items():
        write(path, content)
    copy_mathjax()
    for left_over in set(MADE.rglob("*.*")) - set(pages):
        if left_over.suffix in (".ipynb", ".md"):
            left_over.unlink()


def write(path: Path, content: str | bytes) -> None:
    """Write a file if its content changed, so that Sphinx builds only what did."""
    data = content.encode() if isinstance(content, str) else content
    if not path.is_file() or path.read_bytes() != data:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


def copy_mathjax() -> None:
    """Copy MathJax (Apache License 2.0), one file that holds all it needs, from the package that brings it."""
    package = distribution("sphinx-mathjax-offline")
    file = Path(str(package.locate_file("sphinx-mathjax-offline/static/mathjax/tex-svg.js")))
    write(STATIC / "mathjax" / file.name, file.read_bytes())


# Notebooks


def read_plain(path: Path) -> NotebookNode:
    """Return a notebook as it is, not executed."""
    return nbformat.read(path, as_version=4)


def notebook_page(notebook: NotebookNode, target: Path) -> dict[Path, str | bytes]:
    """Return the page of a notebook, and its pictures as files of their own, numbered and with captions."""
    made: dict[Path, str | bytes] = {}
    cells = []
    for cell in notebook.cells:
        cell.metadata.pop("nbgrader", None)
        cells.append(cell)
        if cell.cell_type != "code":
            continue
        cell.execution_count = None
        figures = []
        for output in cell.outputs:
            output.metadata = {}
            if output.output_type == "execute_result":
                output.execution_count = None
            figures += take_pictures(output, f"{target.stem}-{cell.id}-{len(figures)}", target.parent / "images", made)
        cell.outputs = [output for output in cell.outputs if output.get("data") != {}]
        cells += [
            nbformat.v4.new_markdown_cell(figure, id=f"{cell.id}-figure-{i}"[-64:]) for i, figure in enumerate(figures)
        ]
    notebook.cells = cells
    notebook.metadata = {"kernelspec": notebook.metadata["kernelspec"]}
    made[target] = nbformat.writes(notebook) + "\n"
    return made


def take_pictures(output: NotebookNode, name: str, folder: Path, made: dict[Path, str | bytes]) -> list[str]:
    """Take the pictures out of an output, write them to files, and return a figure for each."""
    page = output.get("data", {}).get("text/html", "")
    if PLAYER in page or not PICTURE.search(page):
        return []
    figures = []
    for i, (alt, width, data) in enumerate(PICTURE.findall(page)):
        file = folder / f"{name}-{i}.png"
        made[file] = base64.b64decode(data)
        alt = html.unescape(alt).replace("\n", " ")
        figures.append(f":::{{figure}} images/{file.name}\n:alt: {alt}\n:width: {width}px\n\n{caption(alt)}\n:::")
    output.data = {}
    return figures


def caption(alt: str) -> str:
    """Return what the alternative text of a picture begins with: its first sentence, without the numbers that a long one lists."""
    sentence = re.split(r"(?<=[.!?]) (?=\w)", alt)[0]
    if len(sentence) > LONG_CAPTION:
        sentence = sentence.partition(": ")[0]
    if re.match("[a-z]{3}", sentence):
        sentence = sentence[0].upper() + sentence[1:]
    return re.sub(r"([*_`$\\])", r"\\\1", sentence if sentence.endswith(".") else f"{sentence}.")


# The paper map, run times


def read_paper_map() -> list[dict[str, str]]:
    """Return the rows of the paper map: "part", "about", "function", "test", "lesson", "figure"."""
    with PAPER_MAP.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def paper_map() -> str:
    """Return the page that leads from each part of the paper to the code."""
    rows = [
        "---",
        "html_theme.sidebar_secondary.remove: true",
        "---",
        "",
        "# From paper to code",
        "",
        "Every section, algorithm, equation, figure and appendix of the paper, and where it is here. Tests are named",
        "by their file and what they say; a figure is the function that draws it.",
        "",
        "| the paper | what | function | test | lesson | figure |",
        "|---|---|---|---|---|---|",
    ]
    for row in read_paper_map():
        functions = " ".join(reference(name) for name in row["function"].split())
        figures = " ".join(reference(name) for name in row["figure"].split())
        tests = "<br>".join(
            f"`{file}`: {name.removeprefix('test_').replace('_', ' ')}" for file, name in named_tests(row["test"])
        )
        lessons = " ".join(f"[{name[:2]}](course/{name}.ipynb)" for name in row["lesson"].split())
        rows.append(f"| {row['part']} | {row['about']} | {functions} | {tests} | {lessons} | {figures} |")
    return "\n".join(rows) + "\n"


def named_tests(cell: str) -> list[tuple[str, str]]:
    """Return file and name of each test in a cell of the paper map: ``test_file.py::test_name test_other.py::test_name``."""
    return [(file, name) for file, _, name in (test.partition("::") for test in cell.split())]


def reference(name: str) -> str:
    """Return a link to the API reference of ``module.name``, such as ``effects.EffectClasses``."""
    parts = name.split(".")
    method = parts[-2][:1].isupper()
    kind = "class" if parts[-1][:1].isupper() else "meth" if method else "func"
    return f"{{py:{kind}}}`{'.'.join(parts[-2 if method else -1 :])} <stairlab.{name}>`"


def run_times() -> str:
    """Return the page of run times: what each lesson states, and what it took for this book."""
    rows = [
        "# Run times",
        "",
        "How long each lesson takes to read, as it says itself, and to run from top to bottom: as it says, and as measured",
        "when this book was made, with the pictures that stand in for live widgets.",
        "",
        "| lesson | to read [min] | to run, stated [s] | to run, measured [s] |",
        "|---|---|---|---|",
    ]
    for path in execute.LESSONS:
        notebook = execute.executed(path)
        opening = notebook.cells[0].source
        reading, running = re.search(r"\*\*Time\*\* (\d+) minutes to read, (\d+) seconds to run", opening).groups()
        title = re.match(r"# (.+)", opening).group(1)
        rows.append(
            f"| [{title}](course/{path.name}) | {reading} | {running} | {notebook.metadata.stairlab.seconds:.0f} |"
        )
    return "\n".join(rows) + "\n"


# The API reference


def api_modules() -> dict[str, list[str]]:
    """Return the public names of each module of the reference."""
    modules = {name: list(names) for name, names in stairlab._MODULES.items() if names}
    return modules | {name: list(import_module(f"stairlab.{name}").__all__) for name in ("course", "checks")}


def api_page(module: str, names: list[str]) -> str:
    """Return the reference page of a module."""
    described = [f".. automodule:: stairlab.{module}", "   :members: " + ", ".join(names)]
    if module in ("clustering", "course", "checks"):
        described.append("   :imported-members:")
    return "\n".join([f"# stairlab.{module}", "", "```{eval-rst}", *described, "```", ""])
