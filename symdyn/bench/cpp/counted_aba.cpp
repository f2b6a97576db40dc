// The arithmetic that Pinocchio's articulated-body algorithm does, counted by a scalar of its own. Stands after
// pinocchio_aba.cpp.

#include <cmath>

namespace counting {

// A double that counts what is done with it: + - * / sqrt sin cos, one each; a change of sign is free.
struct Counted {
    double value = 0;
    static long count;

    Counted() = default;
    Counted(double v) : value(v) {}
    explicit operator double() const { return value; }
    explicit operator int() const { return static_cast<int>(value); }
    explicit operator long() const { return static_cast<long>(value); }
    Counted operator-() const { return Counted(-value); }
    Counted operator+() const { return *this; }
    Counted &operator+=(const Counted &b) { return *this = *this + b; }
    Counted &operator-=(const Counted &b) { return *this = *this - b; }
    Counted &operator*=(const Counted &b) { return *this = *this * b; }
    Counted &operator/=(const Counted &b) { return *this = *this / b; }
    static Counted done(double v)
    {
        count++;
        return Counted(v);
    }
    friend Counted operator+(const Counted &a, const Counted &b) { return done(a.value + b.value); }
    friend Counted operator-(const Counted &a, const Counted &b) { return done(a.value - b.value); }
    friend Counted operator*(const Counted &a, const Counted &b) { return done(a.value * b.value); }
    friend Counted operator/(const Counted &a, const Counted &b) { return done(a.value / b.value); }
    friend bool operator<(const Counted &a, const Counted &b) { return a.value < b.value; }
    friend bool operator>(const Counted &a, const Counted &b) { return a.value > b.value; }
    friend bool operator<=(const Counted &a, const Counted &b) { return a.value <= b.value; }
    friend bool operator>=(const Counted &a, const Counted &b) { return a.value >= b.value; }
    friend bool operator==(const Counted &a, const Counted &b) { return a.value == b.value; }
    friend bool operator!=(const Counted &a, const Counted &b) { return a.value != b.value; }
    friend std::ostream &operator<<(std::ostream &out, const Counted &a) { return out << a.value; }
};

long Counted::count = 0;

inline Counted sqrt(const Counted &a) { return Counted::done(std::sqrt(a.value)); }
inline Counted sin(const Counted &a) { return Counted::done(std::sin(a.value)); }
inline Counted cos(const Counted &a) { return Counted::done(std::cos(a.value)); }
inline Counted acos(const Counted &a) { return Counted::done(std::acos(a.value)); }
inline Counted asin(const Counted &a) { return Counted::done(std::asin(a.value)); }
inline Counted atan2(const Counted &a, const Counted &b) { return Counted::done(std::atan2(a.value, b.value)); }
inline Counted pow(const Counted &a, const Counted &b) { return Counted::done(std::pow(a.value, b.value)); }
inline Counted exp(const Counted &a) { return Counted::done(std::exp(a.value)); }
inline Counted log(const Counted &a) { return Counted::done(std::log(a.value)); }
inline Counted abs(const Counted &a) { return Counted(std::fabs(a.value)); }
inline Counted fabs(const Counted &a) { return abs(a); }
inline Counted abs2(const Counted &a) { return a * a; }
inline bool isfinite(const Counted &a) { return std::isfinite(a.value); }
inline bool isnan(const Counted &a) { return std::isnan(a.value); }
inline bool isinf(const Counted &a) { return std::isinf(a.value); }

} // namespace counting

namespace Eigen {
template <>
struct NumTraits<counting::Counted> : NumTraits<double> {
    using Real = counting::Counted;
    using NonInteger = counting::Counted;
    using Nested = counting::Counted;
    using Literal = double;
    enum { IsComplex = 0, IsInteger = 0, IsSigned = 1, RequireInitialization = 1, ReadCost = 1, AddCost = 1, MulCost = 1 };
    static Real epsilon() { return NumTraits<double>::epsilon(); }
    static Real dummy_precision() { return NumTraits<double>::dummy_precision(); }
    static Real highest() { return NumTraits<double>::highest(); }
    static Real lowest() { return NumTraits<double>::lowest(); }
};
} // namespace Eigen

// operations of one evaluation at (q, v), or -1 with a message in `error`
extern "C" long aba_operations(const char *text, const double *q, const double *v, char *error, long size)
{
    using counting::Counted;
    long found = -1;
    peers::guarded(error, size, [&] {
        Model<Counted> c(text, {});
        Model<Counted>::Vector at(c.model.nq), speeds(c.model.nv);
        for (int i = 0; i < c.model.nq; i++) at[i] = q[i];
        for (int i = 0; i < c.model.nv; i++) speeds[i] = v[i];
        Counted::count = 0;
        pinocchio::aba(c.model, c.data, at, speeds, c.torques);
        found = Counted::count;
    });
    return found;
}
