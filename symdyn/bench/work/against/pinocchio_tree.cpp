// Pinocchio's articulated-body algorithm on CasADi's symbols, for trees of revolute and prismatic joints in numbers.

#include <pinocchio/autodiff/casadi.hpp>

#include <sstream>
#include <string>

#include <pinocchio/multibody.hpp>
#include <pinocchio/algorithm/aba.hpp>

namespace trees {

using namespace pinocchio;

// Compiling the algorithm for all joints of Pinocchio takes minutes.
template <class S, int O>
struct TwoJoints {
    using Scalar = S;
    static constexpr int Options = O;
    using Turning = JointModelRevoluteTpl<S, O, 2>;
    using Sliding = JointModelPrismaticTpl<S, O, 2>;
    using JointModelMimic = JointModelMimicTpl<S, O, TwoJoints>;
    using JointModelVariant = boost::variant<Turning, Sliding, boost::recursive_wrapper<JointModelMimic>>;
    using JointDataMimic = JointDataMimicTpl<S, O, TwoJoints>;
    using JointDataVariant = boost::variant<JointDataRevoluteTpl<S, O, 2>, JointDataPrismaticTpl<S, O, 2>,
                                            boost::recursive_wrapper<JointDataMimic>>;
};

} // namespace trees

namespace {

using casadi::SX;
using trees::TwoJoints;

template <int Rows, int Columns>
Eigen::Matrix<SX, Rows, Columns> matrix(std::istream &words)
{
    Eigen::Matrix<SX, Rows, Columns> found;
    for (int i = 0; i < Rows; i++)
        for (int j = 0; j < Columns; j++) {
            double number;
            words >> number;
            found(i, j) = SX(number);
        }
    return found;
}

Eigen::Matrix<SX, Eigen::Dynamic, 1> vector(const SX &column)
{
    Eigen::Matrix<SX, Eigen::Dynamic, 1> found(column.size1());
    for (casadi_int i = 0; i < column.size1(); i++) found[i] = column(i);
    return found;
}

// Numbers: gravity (3); then of each link its parent (0 the ground), 1 for turning or 0, R (9) row by row, p (3), mass, centre of
// mass (3), inertia about it (9).
casadi::Function accelerations(const char *text)
{
    std::istringstream words(text);
    pinocchio::ModelTpl<SX, 0, TwoJoints> model;
    model.gravity.linear() = matrix<3, 1>(words);
    for (pinocchio::JointIndex parent; words >> parent;) {
        bool turning;
        words >> turning;
        const auto R = matrix<3, 3>(words);
        const auto p = matrix<3, 1>(words);
        const pinocchio::SE3Tpl<SX> place(R, p);
        const std::string name = "joint" + std::to_string(model.njoints);
        const pinocchio::JointIndex joint = turning ? model.addJoint(parent, TwoJoints<SX, 0>::Turning(), place, name)
                                         : model.addJoint(parent, TwoJoints<SX, 0>::Sliding(), place, name);
        const SX mass = matrix<1, 1>(words)(0, 0);
        const auto com = matrix<3, 1>(words);
        const auto inertia = matrix<3, 3>(words);
        model.inertias.at(joint) = pinocchio::InertiaTpl<SX>(mass, com, pinocchio::Symmetric3Tpl<SX>(inertia));
    }
    pinocchio::DataTpl<SX, 0, TwoJoints> data(model);
    const SX q = SX::sym("q", model.nq), u = SX::sym("u", model.nv), tau = SX::sym("tau", model.nv);
    pinocchio::aba(model, data, vector(q), vector(u), vector(tau));
    SX result = SX::zeros(model.nv);
    for (casadi_int i = 0; i < model.nv; i++) result(i) = data.ddq[i];
    return casadi::Function("accelerations", {q, u, tau}, {result}, {"q", "u", "tau"}, {"u_dot"});
}

} // namespace

// The serialized function (q, u, tau) -> u_dot, or null with a message in `error`.
extern "C" const char *pinocchio_tree(const char *text, char *error, long size)
{
    static std::string kept;
    try {
        kept = accelerations(text).serialize();
        return kept.c_str();
    } catch (const std::exception &problem) {
        error[std::string(problem.what()).copy(error, size - 1)] = 0;
        return nullptr;
    }
}
