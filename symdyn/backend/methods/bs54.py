"""Bogacki-Shampine 5(4). The dense output is derived for symdyn: of all polynomials of degree 4 that fit value and derivative at
both ends and are of order 4 by the stages alone, the one with the smallest residuals of the conditions of order 5."""

from symdyn.backend.methods.record import Method, Tableau

_A = {
    1: {0: 1 / 6},
    2: {0: 2 / 27, 1: 4 / 27},
    3: {0: 183 / 1372, 1: -162 / 343, 2: 1053 / 1372},
    4: {0: 68 / 297, 1: -4 / 11, 2: 42 / 143, 3: 1960 / 3861},
    5: {0: 597 / 22528, 1: 81 / 352, 2: 63099 / 585728, 3: 58653 / 366080, 4: 4617 / 20480},
    6: {0: 174197 / 959244, 1: -30942 / 79937, 2: 8152137 / 19744439, 3: 666106 / 1039181, 4: -29421 / 29068, 5: 482048 / 414219},
}
_B = {0: 587 / 8064, 2: 4440339 / 15491840, 3: 24353 / 124800, 4: 387 / 44800, 5: 2152 / 5985, 6: 7267 / 94080}
_EMBEDDED = {0: 2479 / 34992, 2: 123 / 416, 3: 612941 / 3411720, 4: 43 / 1440, 5: 2272 / 6561, 6: 79937 / 1113912,
             7: 3293 / 556956}
# The estimate is that of order 4, six times: so errors of whole runs are those of dop853 at the same tolerance, within a factor
# of four on seven mechanisms (medians over rtol of 1e-2 to 1e-6), and the choice between the two is one of work alone.
_SHARPER = 6.0
_D = {0: -11269 / 8064, 2: 7254279 / 3098368, 3: 110789 / 224640, 4: -1161 / 8960, 5: -9512 / 3591, 6: -7267 / 6272, 7: 5 / 2}

BS54 = Method(
    "bs54", "Bogacki-Shampine 5(4): order 5, error estimate of order 4, dense output of order 4", 5, "explicit",
    ("P. Bogacki, L. F. Shampine, An Efficient Runge-Kutta (4,5) Pair, Computers & Mathematics with Applications 32 (1996)",
     "15-28. The dense output is derived here from the order conditions."),
    Tableau({1: 1 / 6, 2: 2 / 9, 3: 3 / 7, 4: 2 / 3, 5: 3 / 4}, _A, _B,
            {k: _SHARPER * (_B.get(k, 0.0) - v) for k, v in _EMBEDDED.items()}, (_D,)), crosses=True)
