// Pinocchio's articulated-body algorithm in double precision, in a loop in which each evaluation waits for the one before.

#include <pinocchio/algorithm/aba.hpp>

namespace {

struct Program {
    pinocchio::Model model;
    pinocchio::Data data;
    Eigen::VectorXd torques;

    explicit Program(pinocchio::Model made) : model(made), data(made), torques(Eigen::VectorXd::Zero(made.nv)) {}
};

} // namespace

extern "C" {

// null, with a message in `error`, if the description cannot be read; what it returns lives until the process ends
void *aba_open(const char *text, const double *parameters, long count, char *error, long size)
{
    Program *made = nullptr;
    peers::guarded(error, size, [&] {
        const std::vector<double> numbers(parameters, parameters + count);
        made = new Program(peers::build<double, pinocchio::JointCollectionDefaultTpl>(text, numbers));
    });
    return made;
}

// n evaluations of the accelerations at (q, u); q[fed] of each depends on the result of the one before
void aba_loop(void *opened, long n, long fed, double *q, const double *u, double *accelerations)
{
    Program &c = *static_cast<Program *>(opened);
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
