// Pinocchio's constrained dynamics in double precision, in a loop in which each evaluation waits for the one before.
//
// The matrix [[M, J^T], [J, -mu]] is solved with by Pinocchio's sparse Cholesky factorization of the whole (constraintDynamics).
// J has the three rows of a point contact, because Pinocchio has no planar one. In a planar mechanism the
// row along z is zero: mu keeps the matrix regular, and that multiplier at zero. The proximal iteration takes what mu does to the
// other rows out again, until the residual is below the tolerance; with a mu this small the first solution is.

#include <pinocchio/algorithm/constrained-dynamics.hpp>

namespace {

const double TOLERANCE = 1e-10, MU = 1e-12;
const int ITERATIONS = 10;

struct Program {
    pinocchio::Model model;
    pinocchio::Data data;
    Eigen::VectorXd torques;
    std::vector<pinocchio::RigidConstraintModel> contacts;
    std::vector<pinocchio::RigidConstraintData> found;
    pinocchio::ProximalSettings settings{TOLERANCE, MU, ITERATIONS};

    Program(pinocchio::Model made, int joint, const double *point, const double *ground)
        : model(made), data(made), torques(Eigen::VectorXd::Zero(made.nv))
    {
        pinocchio::SE3 on_body = pinocchio::SE3::Identity(), on_ground = pinocchio::SE3::Identity();
        on_body.translation() = Eigen::Vector3d(point);
        on_ground.translation() = Eigen::Vector3d(ground);
        contacts.emplace_back(pinocchio::CONTACT_3D, model, joint, on_body, 0, on_ground, pinocchio::LOCAL);
        found.emplace_back(contacts.back());
        pinocchio::initConstraintDynamics(model, data, contacts, found);
    }
};

} // namespace

extern "C" {

// `point` of the body that `joint` moves is held at `ground`. null, with a message in `error`, if the description cannot be
// read; what it returns lives until the process ends
void *loop_open(const char *text, const double *parameters, long count, long joint, const double *point, const double *ground,
                char *error, long size)
{
    Program *made = nullptr;
    peers::guarded(error, size, [&] {
        const std::vector<double> numbers(parameters, parameters + count);
        made = new Program(peers::build<double, pinocchio::JointCollectionDefaultTpl>(text, numbers), int(joint), point, ground);
    });
    return made;
}

// n evaluations of the accelerations at (q, u); q[fed] of each depends on the result of the one before. `force`: on the body
// at the point, world axes
void loop_loop(void *opened, long n, long fed, double *q, const double *u, double *accelerations, double *force)
{
    Program &c = *static_cast<Program *>(opened);
    Eigen::Map<Eigen::VectorXd> at(q, c.model.nq), result(accelerations, c.model.nv);
    const Eigen::Map<const Eigen::VectorXd> speeds(u, c.model.nv);
    const double start = q[fed];
    for (long i = 0; i < n; i++) {
        pinocchio::constraintDynamics(c.model, c.data, at, speeds, c.torques, c.contacts, c.found, c.settings);
        q[fed] = start + 1e-9 * c.data.ddq[c.model.nv - 1];
    }
    q[fed] = start;
    result = c.data.ddq;
    Eigen::Map<Eigen::Vector3d>{force} = c.found[0].oMc1.rotation() * c.found[0].contact_force.linear();
}

}
