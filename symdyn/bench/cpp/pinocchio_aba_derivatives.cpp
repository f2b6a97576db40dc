// Pinocchio's derivatives of the articulated-body algorithm in double precision, in a loop in which each evaluation waits for the
// one before. Stands after pinocchio_aba.cpp.

#include <pinocchio/algorithm/aba-derivatives.hpp>

// n evaluations of the derivatives of the accelerations by the position and the velocity at (q, u); q[fed] of each depends on the
// result of the one before. `derivatives`: row by row, those by the position, then those by the velocity
extern "C" void aba_derivatives_loop(void *opened, long n, long fed, double *q, const double *u, double *derivatives)
{
    Model<double> &c = *static_cast<Model<double> *>(opened);
    Eigen::Map<Eigen::VectorXd> at(q, c.model.nq);
    const Eigen::Map<const Eigen::VectorXd> speeds(u, c.model.nv);
    const double start = q[fed];
    const int last = c.model.nv - 1;
    for (long i = 0; i < n; i++) {
        pinocchio::computeABADerivatives(c.model, c.data, at, speeds, c.torques);
        q[fed] = start + 1e-9 * c.data.ddq_dv(last, last);
    }
    q[fed] = start;
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> result(derivatives, c.model.nv, 2 * c.model.nv);
    result << c.data.ddq_dq, c.data.ddq_dv;
}
