// Pinocchio's articulated-body algorithm on a robot, in a loop in which each evaluation waits for the one before; and the
// arithmetic that it does, counted by a scalar of its own. Stands after model.hpp, whose Reader takes the numbers of
//   joint PARENT KIND  X Y Z  R11 R12 R13 R21 ... R33  X Y Z     parent; kind; axis; place on the parent, its axes
//   body JOINT M  X Y Z  XX XY XZ YY YZ ZZ                       as in model.hpp

#include <cmath>

#include <pinocchio/algorithm/aba.hpp>

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

namespace {

template <class Scalar>
pinocchio::ModelTpl<Scalar> robot(const std::string &text)
{
    using Collection = pinocchio::JointCollectionDefaultTpl<Scalar, 0>;
    using Variant = typename Collection::JointModelVariant;
    pinocchio::ModelTpl<Scalar> model;
    peers::Reader<Scalar> reader(text, {});
    std::string what;
    while (reader.next(what)) {
        if (what == "joint") {
            const std::size_t parent = reader.index();
            const std::string kind = reader.word();
            const auto axis = reader.vector();
            const std::map<std::string, Variant> kinds = {
                {"RX", typename Collection::JointModelRX()}, {"RY", typename Collection::JointModelRY()},
                {"RZ", typename Collection::JointModelRZ()}, {"RUBX", typename Collection::JointModelRUBX()},
                {"RUBY", typename Collection::JointModelRUBY()}, {"RUBZ", typename Collection::JointModelRUBZ()},
                {"PX", typename Collection::JointModelPX()}, {"PY", typename Collection::JointModelPY()},
                {"PZ", typename Collection::JointModelPZ()}, {"FreeFlyer", typename Collection::JointModelFreeFlyer()},
                {"Planar", typename Collection::JointModelPlanar()},
                {"RevoluteUnaligned", typename Collection::JointModelRevoluteUnaligned(axis)},
                {"RevoluteUnboundedUnaligned", typename Collection::JointModelRevoluteUnboundedUnaligned(axis)},
                {"PrismaticUnaligned", typename Collection::JointModelPrismaticUnaligned(axis)}};
            const auto found = kinds.find(kind);
            if (found == kinds.end()) throw std::runtime_error("unknown kind of joint '" + kind + "'");
            pinocchio::SE3Tpl<Scalar> place;
            for (int i = 0; i < 3; i++)
                for (int j = 0; j < 3; j++) place.rotation()(i, j) = reader.number();
            place.translation() = reader.vector();
            model.addJoint(parent, found->second, place, "joint" + std::to_string(model.njoints));
        } else if (what == "body") {
            const std::size_t joint = reader.index();
            const Scalar mass = reader.number();
            const auto com = reader.vector();
            const pinocchio::Symmetric3Tpl<Scalar> inertia(reader.symmetric());
            model.inertias.at(joint) = pinocchio::InertiaTpl<Scalar>(mass, com, inertia);
        } else {
            throw std::runtime_error("unknown line '" + what + "'");
        }
    }
    return model;
}

template <class Scalar>
struct Opened {
    using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
    pinocchio::ModelTpl<Scalar> model;
    pinocchio::DataTpl<Scalar> data;
    Vector torques;

    explicit Opened(const std::string &text) : model(robot<Scalar>(text)), data(model), torques(Vector::Zero(model.nv)) {}
};

} // namespace

extern "C" {

// null, with a message in `error`, if the text cannot be read; what it returns lives until the process ends
void *robot_open(const char *text, char *error, long size)
{
    Opened<double> *made = nullptr;
    peers::guarded(error, size, [&] { made = new Opened<double>(text); });
    return made;
}

// n evaluations of the accelerations at (q, v); q[fed] of each depends on the result of the one before
void robot_loop(void *opened, long n, long fed, double *q, const double *v, double *accelerations)
{
    Opened<double> &c = *static_cast<Opened<double> *>(opened);
    Eigen::Map<Eigen::VectorXd> at(q, c.model.nq), result(accelerations, c.model.nv);
    const Eigen::Map<const Eigen::VectorXd> speeds(v, c.model.nv);
    const double start = q[fed];
    for (long i = 0; i < n; i++) {
        pinocchio::aba(c.model, c.data, at, speeds, c.torques);
        q[fed] = start + 1e-9 * c.data.ddq[c.model.nv - 1];
    }
    q[fed] = start;
    result = c.data.ddq;
}

// operations of one evaluation at (q, v), or -1 with a message in `error`
long robot_operations(const char *text, const double *q, const double *v, char *error, long size)
{
    using counting::Counted;
    long found = -1;
    peers::guarded(error, size, [&] {
        Opened<Counted> c(text);
        Opened<Counted>::Vector at(c.model.nq), speeds(c.model.nv);
        for (int i = 0; i < c.model.nq; i++) at[i] = q[i];
        for (int i = 0; i < c.model.nv; i++) speeds[i] = v[i];
        Counted::count = 0;
        pinocchio::aba(c.model, c.data, at, speeds, c.torques);
        found = Counted::count;
    });
    return found;
}

}
