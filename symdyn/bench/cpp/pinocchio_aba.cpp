// Pinocchio's articulated-body algorithm in double precision, in a loop in which each evaluation waits for the one before.

#include <pinocchio/algorithm/aba.hpp>

namespace {

// Further joints of robots, some of them about an axis that the description has.
struct OfRobots {
    template <class Kinds, class Axis>
    void add(Kinds &kinds, const Axis &axis) const
    {
        using Collection = pinocchio::JointCollectionDefaultTpl<typename Axis::Scalar, 0>;
        kinds["RUBX"] = typename Collection::JointModelRUBX();
        kinds["RUBY"] = typename Collection::JointModelRUBY();
        kinds["RUBZ"] = typename Collection::JointModelRUBZ();
        kinds["FreeFlyer"] = typename Collection::JointModelFreeFlyer();
        kinds["Planar"] = typename Collection::JointModelPlanar();
        kinds["RevoluteUnaligned"] = typename Collection::JointModelRevoluteUnaligned(axis);
        kinds["RevoluteUnboundedUnaligned"] = typename Collection::JointModelRevoluteUnboundedUnaligned(axis);
        kinds["PrismaticUnaligned"] = typename Collection::JointModelPrismaticUnaligned(axis);
    }
};

template <class Scalar>
struct Model {
    using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
    pinocchio::ModelTpl<Scalar> model;
    pinocchio::DataTpl<Scalar> data;
    Vector torques;

    Model(const std::string &text, const std::vector<Scalar> &parameters)
        : model(peers::build<Scalar, pinocchio::JointCollectionDefaultTpl>(text, parameters, OfRobots())), data(model),
          torques(Vector::Zero(model.nv))
    {
    }
};

} // namespace

extern "C" {

// null, with a message in `error`, if the description cannot be read; what it returns lives until the process ends
void *aba_open(const char *text, const double *parameters, long count, char *error, long size)
{
    Model<double> *made = nullptr;
    peers::guarded(error, size, [&] { made = new Model<double>(text, std::vector<double>(parameters, parameters + count)); });
    return made;
}

// n evaluations of the accelerations at (q, u); q[fed] of each depends on the result of the one before
void aba_loop(void *opened, long n, long fed, double *q, const double *u, double *accelerations)
{
    Model<double> &c = *static_cast<Model<double> *>(opened);
    Eigen::Map<Eigen::VectorXd> at(q, c.model.nq), result(accelerations, c.model.nv);
    const Eigen::Map<const Eigen::VectorXd> speeds(u, c.model.nv);
    const double start = q[fed];
    for (long i = 0; i < n; i++) {
        pinocchio::aba(c.model, c.data, at, speeds, c.torques);
        q[fed] = start + 1e-9 * c.data.ddq[c.model.nv - 1];
    }
    q[fed] = start;
    result = c.data.ddq;
}

}
