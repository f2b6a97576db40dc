"""A document of MJCF as one text without includes, whose files are all inside one folder."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from xml.sax.saxutils import quoteattr

from symdyn.shown import shown
from symdyn.urdf.document import Element, read_document
from symdyn.urdf.values import FileFaults

KIND = "an MJCF"
# The keyframe that a written file has, with the initial values.
START = "initial"
# Elements that have no part in the dynamics; what refers to them goes with them.
_IDLE = ("texture", "skin", "sensor", "visual", "statistic")
# Elements that name files, and the attributes of <compiler> with the folder that these are in.
_FOLDERS = {"mesh": ("meshdir", "assetdir"), "hfield": ("meshdir", "assetdir")}
# Includes in includes.
_DEEPEST = 32


@dataclass
class Expanded:
    """A document with its includes put in.

    text    one element a line; lines: the file and the line that each of these lines is from, in order
    """

    text: str = ""
    lines: list[tuple[Path, int]] = field(default_factory=list)

    def where(self, path: Path, line: int) -> str:
        """FILE:LINE of a line of the text; the file alone for none."""
        if not 1 <= line <= len(self.lines):
            return str(path)
        file, number = self.lines[line - 1]
        return f"{file}:{number}"


class Reader:
    """Reads a document and what it includes.

    path     of the document, or what stands for it in messages where the text is given
    folder   that no file may be outside of; None: the document may refer to none
    """

    def __init__(self, path: Path, folder: Path | None, faults: FileFaults) -> None:
        self.path = path
        self.folder = None if folder is None else folder.resolve()
        self.faults = faults
        self.compiler: dict[str, str] = {}
        self.expanded = Expanded()
        # The file of elements that are not the document's own, by identity; the lines of the text.
        self.sources: dict[int, Path] = {}
        self.rows: list[str] = []

    def read(self, given: bytes | None = None) -> Element | None:
        """The root element, its includes put in; None where it is no MJCF."""
        root = read_document(self.path, KIND, given)
        if root.tag != "mujoco":
            self.faults.at(root.line, f"the file holds a <{root.tag}>; an MJCF holds a <mujoco>")
            return None
        self._put_in(root, self.path, (self.path.resolve(),))
        for element in root.everything():
            if element.tag == "compiler":
                self.compiler.update(element.attributes)
        if not self.faults:
            self._write(root, self.path, 0)
        self.expanded.text = "\n".join(self.rows)
        return root

    # -- includes

    def _put_in(self, parent: Element, path: Path, chain: tuple[Path, ...]) -> None:
        """Replace every <include> by what its file holds."""
        taken: list[Element] = []
        for child in parent.children:
            if child.tag != "include":
                self._put_in(child, path, chain)
                taken.append(child)
                continue
            result = self._inside(child, "file", path, self.path.parent)
            if result is None:
                continue
            if result in chain or len(chain) > _DEEPEST:
                self._at(path, child.line, f"<include> of {shown(child.attributes['file'])} leads back to a file that it is in; "
                                           "leave it out")
                continue
            inner = read_document(result, KIND)
            self._put_in(inner, result, (*chain, result))
            for element in inner.children:
                for each in element.everything():
                    self.sources.setdefault(id(each), result)
            taken += inner.children
        parent.children[:] = taken

    # -- files

    def _at(self, path: Path, line: int, fault: str) -> None:
        self.faults.append(f"{path}:{line}: {fault}")

    def _inside(self, element: Element, attribute: str, path: Path, base: Path) -> Path | None:
        """The existing file inside the folder that an attribute names, seen from a base."""
        name = element.attributes.get(attribute, "")
        what = f"<{element.tag}> has {attribute}={shown(name)}"
        if not name:
            self._at(path, element.line, f"<{element.tag}> has no {attribute}; write {attribute}=\"...\"")
            return None
        if self.folder is None:
            self._at(path, element.line, f"{what}, and a text has no folder that files are in; pass folder=...")
            return None
        if "://" in name or ":" in name or "\\" in name or "\0" in name:
            self._at(path, element.line, f"{what}; write the path of a file with / between its parts, inside {self.folder}")
            return None
        result = (base / name).resolve()
        if not result.is_relative_to(self.folder):
            self._at(path, element.line, f"{what}, which is outside of the folder {self.folder}; pass folder=... with one that "
                                         "holds all files of the model")
            return None
        if not result.is_file():
            self._at(path, element.line, f"{what}, and there is no file {result}")
            return None
        return result

    def _asset(self, element: Element, path: Path) -> str:
        """The absolute path of the file of a mesh or a height field."""
        name = element.attributes["file"]
        if self.compiler.get("strippath") == "true":
            name = PurePosixPath(name.replace("\\", "/")).name
        folder = next((self.compiler[a] for a in _FOLDERS[element.tag] if self.compiler.get(a)), "")
        taken = Element(element.tag, {**element.attributes, "file": name}, element.line)
        result = self._inside(taken, "file", path, self.path.parent / folder)
        return "" if result is None else str(result)

    # -- the text

    def _write(self, element: Element, path: Path, depth: int) -> None:
        path = self.sources.get(id(element), path)
        attributes = dict(element.attributes)
        if depth == 1 and element.tag in _IDLE:
            return
        if element.tag in ("texture", "skin") or (element.tag == "layer" and "texture" in attributes):
            return
        if element.tag == "material":
            attributes.pop("texture", None)
        if element.tag == "compiler":
            for name in ("meshdir", "assetdir", "texturedir", "strippath"):
                attributes.pop(name, None)
        if element.tag == "model":
            self._at(path, element.line, "<model> attaches another file, which is not read; save the whole model in one file "
                                         "first, "
                                         "as MjSpec.to_xml of MuJoCo writes it")
        elif "file" in attributes and element.tag in _FOLDERS:
            attributes["file"] = self._asset(element, path)
        elif any(name.startswith("file") for name in attributes):
            self._at(path, element.line, f"<{element.tag}> reads a file, which is taken for meshes and height fields alone; "
                                         "leave it "
                                         "out")
        listed = "".join(f" {name}={quoteattr(value)}" for name, value in attributes.items())
        self._row(f"<{element.tag}{listed}{'' if element.children else '/'}>", path, element.line)
        for child in element.children:
            self._write(child, path, depth + 1)
        if element.children:
            self._row(f"</{element.tag}>", path, element.line)

    def _row(self, text: str, path: Path, line: int) -> None:
        self.rows.append(text)
        self.expanded.lines.append((path, line))
