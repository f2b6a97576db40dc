"""Printed formulas compared with derived ones, with a verdict on every entry."""

from symdyn.comparison.case import Case, Erratum, Formula, Remark, Slide
from symdyn.comparison.result import Comparison, Comparisons
from symdyn.comparison.run import compare, compare_lecture
from symdyn.comparison.verdict import Verdict

__all__ = ["Case", "Comparison", "Comparisons", "Erratum", "Formula", "Remark", "Slide", "Verdict", "compare", "compare_lecture"]
