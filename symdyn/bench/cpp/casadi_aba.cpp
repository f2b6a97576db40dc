// Pinocchio's articulated-body algorithm on CasADi's symbols: the accelerations as a CasADi function.

#include <pinocchio/algorithm/aba.hpp>

namespace peers {

using namespace pinocchio;

// Compiling the algorithm for all joints of Pinocchio takes minutes; the symbolic result needs those that occur only.
template <class S, int O>
struct FewJoints {
    using Scalar = S;
    static constexpr int Options = O;
    using JointModelRX = JointModelRevoluteTpl<S, O, 0>;
    using JointModelRY = JointModelRevoluteTpl<S, O, 1>;
    using JointModelRZ = JointModelRevoluteTpl<S, O, 2>;
    using JointModelPX = JointModelPrismaticTpl<S, O, 0>;
    using JointModelPY = JointModelPrismaticTpl<S, O, 1>;
    using JointModelPZ = JointModelPrismaticTpl<S, O, 2>;
    using JointModelSpherical = JointModelSphericalTpl<S, O>;
    // Pinocchio asks each joint whether it is one of these; with Boost's relaxed get the variant answers no.
    using JointModelMimic = JointModelMimicTpl<S, O, FewJoints>;
    using JointModelVariant = boost::variant<JointModelRX, JointModelRY, JointModelRZ, JointModelPX, JointModelPY, JointModelPZ,
                                             JointModelSpherical>;
    using JointDataVariant = boost::variant<
        JointDataRevoluteTpl<S, O, 0>, JointDataRevoluteTpl<S, O, 1>, JointDataRevoluteTpl<S, O, 2>,
        JointDataPrismaticTpl<S, O, 0>, JointDataPrismaticTpl<S, O, 1>, JointDataPrismaticTpl<S, O, 2>,
        JointDataSphericalTpl<S, O>>;
};

} // namespace peers

namespace {

using casadi::SX;

std::vector<SX> entries(const SX &column)
{
    std::vector<SX> found;
    for (casadi_int i = 0; i < column.size1(); i++) found.push_back(column(i));
    return found;
}

Eigen::Matrix<SX, Eigen::Dynamic, 1> vector(const SX &column)
{
    Eigen::Matrix<SX, Eigen::Dynamic, 1> found(column.size1());
    for (casadi_int i = 0; i < column.size1(); i++) found[i] = column(i);
    return found;
}

casadi::Function accelerations(const char *text, const SX &parameters, bool driven)
{
    const auto model = peers::build<SX, peers::FewJoints>(text, entries(parameters));
    pinocchio::DataTpl<SX, 0, peers::FewJoints> data(model);
    const SX q = SX::sym("q", model.nq), u = SX::sym("u", model.nv);
    const SX tau = driven ? SX::sym("tau", model.nv) : SX::zeros(model.nv);
    // The function that pinocchio::aba calls by default. Calling pinocchio::aba would compile the algorithm in world axes, too.
    pinocchio::impl::abaLocalConvention(model, data, vector(q), vector(u), vector(tau));
    SX result = SX::zeros(model.nv);
    for (casadi_int i = 0; i < model.nv; i++) result(i) = data.ddq[i];
    // Numbers are no arguments.
    const SX none(0, 1), forces = driven ? tau : none, p = parameters.is_constant() ? none : parameters;
    return casadi::Function("accelerations", {q, u, forces, p}, {result}, {"q", "u", "tau", "p"}, {"u_dot"});
}

} // namespace

extern "C" {

// The serialized function (q, u, tau, p) -> u_dot, or null with a message in `error`. `runtime`: parameters stay symbols;
// `driven`: so do forces along the speeds, else there are none.
const char *casadi_aba(const char *text, const double *parameters, long count, int runtime, int driven, char *error, long size)
{
    static std::string kept;
    const bool done = peers::guarded(error, size, [&] {
        const std::vector<double> numbers(parameters, parameters + count);
        const SX p = runtime ? SX::sym("p", count) : SX(casadi::DM(numbers));
        kept = accelerations(text, p, driven != 0).serialize();
    });
    return done ? kept.c_str() : nullptr;
}

}
