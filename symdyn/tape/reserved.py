"""Words that are no names in generated code: those of its languages, of their libraries, and its own."""

from __future__ import annotations

import keyword

_C = """auto break case char const continue default do double else enum extern float for goto if inline int long
register restrict return short signed sizeof static struct switch typedef union unsigned void volatile while asm bool
class complex delete explicit export false friend imaginary mutable namespace new operator private protected public
template this throw true try typename using virtual NULL main""".split()
_MATH = """sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp log sqrt cbrt pow fabs fmin fmax floor
ceil erf erfc gamma lgamma tgamma j0 j1 jn y0 y1 yn isnan isinf""".split()
_OTHERS = """abs max min sign pi where sum range len print math numpy np t q u z x ud xd p c w inputs out n status logical_and
logical_or logical_not symdyn_sign let var function null undefined typeof super arguments eval debugger instanceof angles
sines cosines""".split()
# Variables get none of these names.
RESERVED = frozenset([*_C, *_MATH, *_OTHERS, *keyword.kwlist, *keyword.softkwlist])

_BUILT_IN = """acosh asinh copysign drem exp10 exp2 expm1 fdim fma fmod frexp gamma hypot ilogb ldexp llrint llround log10 log1p
log2 logb lrint lround modf nan nearbyint nextafter pow10 remainder remquo rint round scalb scalbln scalbn significand
signbit sincos trunc cabs carg cimag creal conj cproj abort calloc exit free malloc realloc labs llabs memchr memcmp memcpy
memmove memset printf fprintf putchar puts scanf snprintf sprintf strcat strchr strcmp strcpy strlen strncpy strstr index
rindex isalnum isalpha isdigit islower isspace isupper tolower toupper""".split()
# Functions get none of these, which C compilers know already: for double, float and long double.
OF_FUNCTIONS = RESERVED | {f"{name}{kind}" for name in [*_MATH, *_BUILT_IN] for kind in ("", "f", "l")}
