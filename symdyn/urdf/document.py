"""XML text to elements that know their lines."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import ParseError

from symdyn.errors import ArgumentError, MissingExtra, ModelError
from symdyn.shown import shown

# Characters of the longest path of any system.
LONGEST = 4096


@dataclass(frozen=True)
class Element:
    """An element: its tag, attributes, children in order, the line of the file that it begins in, and its text without the blanks
    around it."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)
    written: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        return "".join(self.written).strip()

    def find(self, tag: str) -> Element | None:
        """The first child with a tag."""
        return next(self.all(tag), None)

    def all(self, tag: str) -> Iterator[Element]:
        """The children with a tag."""
        return (child for child in self.children if child.tag == tag)

    def everything(self) -> Iterator[Element]:
        """The element and all in it, in the order of the file."""
        waiting = [self]
        while waiting:
            element = waiting.pop()
            yield element
            waiting += element.children[::-1]


class _Builder:
    """Builder of elements from the parser."""

    def __init__(self) -> None:
        self.parser: Any = None
        self.root: Element | None = None
        self.open: list[Element] = []

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, dict(attributes), self.parser.parser.CurrentLineNumber)
        if self.open:
            self.open[-1].children.append(element)
        elif self.root is None:
            self.root = element
        self.open.append(element)

    def end(self, tag: str) -> None:
        self.open.pop()

    def data(self, text: str) -> None:
        if self.open:
            self.open[-1].written.append(text)

    def close(self) -> Element | None:
        return self.root


def as_path(path: Any, kind: str = "a URDF") -> Path:
    """A path given as text or Path; kind: of the file, with its article. Raises ArgumentError for anything else."""
    if not isinstance(path, (str, Path)) or "\0" in str(path) or len(str(path)) > LONGEST:
        raise ArgumentError(f"the path is {shown(path)}; pass that of {kind} file, as text or a Path")
    return Path(path)


def read_document(path: Path, kind: str = "a URDF", given: bytes | None = None) -> Element:
    """The root element of a file, or of a text that stands for it.

    kind    of the file, with its article, for messages
    Raises ModelError, with file and line, for a file that cannot be read, that is no XML, or that has a document type, by which
    alone entities and other files come in; MissingExtra without defusedxml.
    """
    try:
        from defusedxml.common import DefusedXmlException
        from defusedxml.ElementTree import DefusedXMLParser
    except ImportError:
        raise MissingExtra(f"reading {kind} needs the package defusedxml: pip install 'symdyn[robots]'") from None
    try:
        text = path.read_bytes() if given is None else given
    except OSError as error:
        raise ModelError([f"{path}: the file cannot be read ({error.strerror}); pass the path of {kind} file"]) from None
    builder = _Builder()
    builder.parser = DefusedXMLParser(target=builder, forbid_dtd=True)
    try:
        builder.parser.feed(text)
        root = builder.parser.close()
    except DefusedXmlException:
        line = builder.parser.parser.CurrentLineNumber
        raise ModelError([f"{path}:{line}: the file declares a document type, which is rejected: entities and other files come "
                          f"in by it, and {kind} needs none; leave out <!DOCTYPE ...>"]) from None
    except ParseError as error:
        raise ModelError([f"{path}:{error.position[0]}: {_no_xml(str(error), text, error.position[0], kind)}"]) from None
    except (ValueError, LookupError) as error:
        raise ModelError([f"{path}:1: the text cannot be decoded ({error}); save it as UTF-8"]) from None
    assert isinstance(root, Element)
    return root


def _no_xml(reason: str, text: bytes, line: int, kind: str) -> str:
    """Fault of text that is no XML."""
    reason = reason.partition(":")[0]
    if not text.strip():
        return f"the file is empty; pass {kind} file"
    result = _not_utf8(text)
    if result and "invalid token" in reason:
        return f"{result}, and the file declares no other encoding; save it as UTF-8, or name the encoding in <?xml " \
               "encoding=...?>"
    if reason == "unbound prefix":
        lines = text.decode("utf-8", "replace").splitlines()
        tag = lines[line - 1].strip() if line <= len(lines) else ""
        return (f"a tag has a prefix that the file does not declare, in {shown(tag[:100])}; if it belongs to xacro, run the file "
                "through xacro first")
    return f"the file is no XML there ({reason}); pass {kind} file"


def _not_utf8(text: bytes) -> str:
    """First byte of a text that is not UTF-8; "" if it is."""
    try:
        text.decode("utf-8")
    except UnicodeDecodeError as error:
        return f"the byte 0x{text[error.start]:02x} is not UTF-8"
    return ""
