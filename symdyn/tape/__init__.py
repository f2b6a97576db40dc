"""The tape: straight-line code of small named assignments, between the derivation and everything after it."""

from symdyn.tape.node import Node
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Output, Tape

__all__ = ["Node", "Output", "Recorder", "Tape"]
