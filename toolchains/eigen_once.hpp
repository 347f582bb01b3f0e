// toolchains - Eigen's large classes of dynamic matrices, compiled once and not in every room that uses them. The
// headers that all rooms of the host share include this file; a file that does not gets its own copy. CMake makes the
// source that compiles them of this text, by leaving out "extern" (toolchains/armcal.cmake).
#pragma once

#include <Eigen/Dense>

// Decompositions: what their constructors call, and what solve() calls for one right-hand side and for several.
extern template class Eigen::LLT<Eigen::MatrixXd>;
extern template Eigen::LLT<Eigen::MatrixXd>& Eigen::LLT<Eigen::MatrixXd>::compute(
    const Eigen::EigenBase<Eigen::MatrixXd>&);
extern template void Eigen::LLT<Eigen::MatrixXd>::_solve_impl(const Eigen::VectorXd&, Eigen::VectorXd&) const;
extern template void Eigen::LLT<Eigen::MatrixXd>::_solve_impl(const Eigen::MatrixXd&, Eigen::MatrixXd&) const;
extern template class Eigen::LDLT<Eigen::MatrixXd>;
extern template Eigen::LDLT<Eigen::MatrixXd>& Eigen::LDLT<Eigen::MatrixXd>::compute(
    const Eigen::EigenBase<Eigen::MatrixXd>&);
extern template void Eigen::LDLT<Eigen::MatrixXd>::_solve_impl(const Eigen::VectorXd&, Eigen::VectorXd&) const;
extern template void Eigen::LDLT<Eigen::MatrixXd>::_solve_impl(const Eigen::MatrixXd&, Eigen::MatrixXd&) const;
extern template class Eigen::PartialPivLU<Eigen::MatrixXd>;
extern template class Eigen::HouseholderQR<Eigen::MatrixXd>;
extern template void Eigen::HouseholderQR<Eigen::MatrixXd>::_solve_impl(const Eigen::VectorXd&, Eigen::VectorXd&) const;
extern template void Eigen::HouseholderQR<Eigen::MatrixXd>::_solve_impl(const Eigen::MatrixXd&, Eigen::MatrixXd&) const;
extern template class Eigen::ColPivHouseholderQR<Eigen::MatrixXd>;
extern template void Eigen::ColPivHouseholderQR<Eigen::MatrixXd>::_solve_impl(const Eigen::VectorXd&,
                                                                              Eigen::VectorXd&) const;
extern template void Eigen::ColPivHouseholderQR<Eigen::MatrixXd>::_solve_impl(const Eigen::MatrixXd&,
                                                                              Eigen::MatrixXd&) const;
extern template class Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>;
extern template void Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>::_solve_impl(const Eigen::VectorXd&,
                                                                                          Eigen::VectorXd&) const;
extern template void Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>::_solve_impl(const Eigen::MatrixXd&,
                                                                                          Eigen::MatrixXd&) const;
extern template class Eigen::JacobiSVD<Eigen::MatrixXd>;
extern template class Eigen::JacobiSVD<Eigen::MatrixXd, Eigen::NoQRPreconditioner>;
extern template class Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;
extern template Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>& Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>::compute(
    const Eigen::EigenBase<Eigen::MatrixXd>&, int);
extern template class Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>;
extern template Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>& Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>::compute(
    const Eigen::EigenBase<Eigen::Matrix3d>&, int);

namespace Eigen::internal {

// Products of large matrices, by columns (0) and by rows (1).
extern template struct general_matrix_matrix_product<Index, double, 0, false, double, 0, false, 0, 1>;
extern template struct general_matrix_matrix_product<Index, double, 1, false, double, 0, false, 0, 1>;
extern template struct general_matrix_matrix_product<Index, double, 0, false, double, 1, false, 0, 1>;
extern template struct general_matrix_matrix_product<Index, double, 1, false, double, 1, false, 0, 1>;
extern template struct gebp_kernel<double, double, Index, blas_data_mapper<double, Index, 0, 0, 1>,
                                   gebp_traits<double, double>::mr, gebp_traits<double, double>::nr>;

}  // namespace Eigen::internal
