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
extern template class Eigen::LLT<Eigen::Matrix4d>;
extern template Eigen::LLT<Eigen::Matrix4d>& Eigen::LLT<Eigen::Matrix4d>::compute(
    const Eigen::EigenBase<Eigen::Matrix4d>&);
extern template class Eigen::LDLT<Eigen::MatrixXd>;
extern template Eigen::LDLT<Eigen::MatrixXd>& Eigen::LDLT<Eigen::MatrixXd>::compute(
    const Eigen::EigenBase<Eigen::MatrixXd>&);
extern template void Eigen::LDLT<Eigen::MatrixXd>::_solve_impl(const Eigen::VectorXd&, Eigen::VectorXd&) const;
extern template void Eigen::LDLT<Eigen::MatrixXd>::_solve_impl(const Eigen::MatrixXd&, Eigen::MatrixXd&) const;
extern template class Eigen::PartialPivLU<Eigen::MatrixXd>;
extern template Eigen::PartialPivLU<Eigen::MatrixXd>::PartialPivLU(const Eigen::EigenBase<Eigen::MatrixXd>&);
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
extern template struct gemm_pack_lhs<double, Index, const_blas_data_mapper<double, Index, 0>,
                                     gebp_traits<double, double>::mr, gebp_traits<double, double>::LhsProgress,
                                     gebp_traits<double, double>::LhsPacket4Packing, 0>;
extern template struct gemm_pack_lhs<double, Index, const_blas_data_mapper<double, Index, 1>,
                                     gebp_traits<double, double>::mr, gebp_traits<double, double>::LhsProgress,
                                     gebp_traits<double, double>::LhsPacket4Packing, 1>;
extern template struct gemm_pack_rhs<double, Index, const_blas_data_mapper<double, Index, 0>,
                                     gebp_traits<double, double>::nr, 0>;
extern template struct gemm_pack_rhs<double, Index, blas_data_mapper<double, Index, 0, 0, 1>,
                                     gebp_traits<double, double>::nr, 0, false, true>;

// Products of a matrix and a vector: either by columns (0) and by rows (1).
extern template struct general_matrix_vector_product<Index, double, const_blas_data_mapper<double, Index, 0>, 0, false,
                                                     double, const_blas_data_mapper<double, Index, 0>, false>;
extern template struct general_matrix_vector_product<Index, double, const_blas_data_mapper<double, Index, 0>, 0, false,
                                                     double, const_blas_data_mapper<double, Index, 1>, false>;
extern template struct general_matrix_vector_product<Index, double, const_blas_data_mapper<double, Index, 1>, 1, false,
                                                     double, const_blas_data_mapper<double, Index, 0>, false>;
extern template struct general_matrix_vector_product<Index, double, const_blas_data_mapper<double, Index, 1>, 1, false,
                                                     double, const_blas_data_mapper<double, Index, 1>, false>;

// Equations with a triangle, and products with one, as the decompositions leave it.
extern template struct triangular_solve_matrix<double, Index, OnTheLeft, Lower, false, 0, 0, 1>;
extern template struct triangular_solve_matrix<double, Index, OnTheLeft, Upper, false, 0, 0, 1>;
extern template struct triangular_solve_matrix<double, Index, OnTheLeft, UnitLower, false, 0, 0, 1>;
extern template struct triangular_solve_vector<double, double, Index, OnTheLeft, Lower, false, 0>;
extern template struct triangular_solve_vector<double, double, Index, OnTheLeft, Upper, false, 0>;
extern template struct triangular_solve_vector<double, double, Index, OnTheLeft, Upper, false, 1>;
extern template struct triangular_solve_vector<double, double, Index, OnTheLeft, UnitLower, false, 0>;
extern template struct triangular_solve_vector<double, double, Index, OnTheLeft, UnitUpper, false, 1>;
extern template struct product_triangular_matrix_matrix<double, Index, Lower, true, 0, false, 0, false, 0, 1>;
extern template struct product_triangular_matrix_matrix<double, Index, Upper, true, 1, false, 0, false, 0, 1>;
extern template struct product_triangular_matrix_matrix<double, Index, UnitLower, true, 0, false, 0, false, 0, 1>;
extern template struct product_triangular_matrix_matrix<double, Index, UnitUpper, true, 1, false, 0, false, 0, 1>;

}  // namespace Eigen::internal
