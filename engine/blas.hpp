// The BLAS that SciPy carries, called through the function pointers of its Cython interface
// (scipy.linalg.cython_blas and cython_lapack): full speed, and no library to find at build time.
#pragma once
#include <nanobind/nanobind.h>

#include <stdexcept>
#include <string>

namespace pneumorph {

template <class Real>
struct Blas {
  using Potrf = void (*)(char* uplo, int* n, Real* a, int* lda, int* info);
  using Trsm = void (*)(char* side, char* uplo, char* trans, char* diag, int* m, int* n, Real* alpha,
                        Real* a, int* lda, Real* b, int* ldb);
  using Syrk = void (*)(char* uplo, char* trans, int* n, int* k, Real* alpha, Real* a, int* lda,
                        Real* beta, Real* c, int* ldc);
  using Gemm = void (*)(char* trans_a, char* trans_b, int* m, int* n, int* k, Real* alpha, Real* a,
                        int* lda, Real* b, int* ldb, Real* beta, Real* c, int* ldc);

  using Trsv = void (*)(char* uplo, char* trans, char* diag, int* n, Real* a, int* lda, Real* x, int* stride);
  using Gemv = void (*)(char* trans, int* m, int* n, Real* alpha, Real* a, int* lda, Real* x, int* stride_x, Real* beta,
                        Real* y, int* stride_y);

  // A = L L^T in the lower triangle; the order of the first minor that is not positive, or 0.
  int factorise(int n, Real* a, int lda) const {
    char lower = 'L';
    int info = 0;
    potrf(&lower, &n, a, &lda, &info);
    return info;
  }
  // B <- B L^-T (transposed) or B L^-1, B of (m, n).
  void solve_right(bool transposed, int m, int n, const Real* l, int ldl, Real* b, int ldb) const {
    char side = 'R', lower = 'L', trans = transposed ? 'T' : 'N', diag = 'N';
    Real one = 1.0;
    trsm(&side, &lower, &trans, &diag, &m, &n, &one, const_cast<Real*>(l), &ldl, b, &ldb);
  }
  // x <- L^-1 x, or L^-T x where transposed.
  void solve_one(bool transposed, int n, const Real* l, int ldl, Real* x) const {
    char lower = 'L', trans = transposed ? 'T' : 'N', diag = 'N';
    int stride = 1;
    trsv(&lower, &trans, &diag, &n, const_cast<Real*>(l), &ldl, x, &stride);
  }
  // y <- beta y + alpha op(A) x, A of (m, n).
  void multiply_one(bool transposed, int m, int n, Real alpha, const Real* a, int lda, const Real* x, Real beta, Real* y) const {
    char trans = transposed ? 'T' : 'N';
    int stride = 1;
    gemv(&trans, &m, &n, &alpha, const_cast<Real*>(a), &lda, const_cast<Real*>(x), &stride, &beta, y, &stride);
  }
  // C <- beta C + alpha A A^T in the lower triangle, A of (n, k).
  void add_square(int n, int k, Real alpha, const Real* a, int lda, Real beta, Real* c, int ldc) const {
    char lower = 'L', trans = 'N';
    syrk(&lower, &trans, &n, &k, &alpha, const_cast<Real*>(a), &lda, &beta, c, &ldc);
  }
  // C <- beta C + alpha A op(B), A of (m, k), C of (m, n).
  void multiply(bool transpose_b, int m, int n, int k, Real alpha, const Real* a, int lda, const Real* b,
                int ldb, Real beta, Real* c, int ldc) const {
    char plain = 'N', trans_b = transpose_b ? 'T' : 'N';
    gemm(&plain, &trans_b, &m, &n, &k, &alpha, const_cast<Real*>(a), &lda, const_cast<Real*>(b), &ldb, &beta,
         c, &ldc);
  }

  static const Blas& of_scipy() {
    static const Blas blas = {
        reinterpret_cast<Potrf>(pointer("scipy.linalg.cython_lapack", "potrf", 5)),
        reinterpret_cast<Trsm>(pointer("scipy.linalg.cython_blas", "trsm", 11)),
        reinterpret_cast<Syrk>(pointer("scipy.linalg.cython_blas", "syrk", 10)),
        reinterpret_cast<Gemm>(pointer("scipy.linalg.cython_blas", "gemm", 13)),
        reinterpret_cast<Trsv>(pointer("scipy.linalg.cython_blas", "trsv", 8)),
        reinterpret_cast<Gemv>(pointer("scipy.linalg.cython_blas", "gemv", 11)),
    };
    return blas;
  }

  Potrf potrf;
  Trsm trsm;
  Syrk syrk;
  Gemm gemm;
  Trsv trsv;
  Gemv gemv;

 private:
  // A capsule is named by its C signature: its integers must be ours, and its arguments as many.
  static void* pointer(const char* module, const char* of_either, int arguments) {
    const std::string function = (sizeof(Real) == 4 ? "s" : "d") + std::string(of_either);
    nanobind::object table = nanobind::module_::import_(module).attr("__pyx_capi__");
    nanobind::object capsule = table[function.c_str()];
    const char* name = PyCapsule_GetName(capsule.ptr());
    const std::string signature = name ? name : "";
    int commas = 0;
    for (char c : signature) commas += c == ',';
    if (commas + 1 != arguments || signature.find("int *") == std::string::npos)
      throw std::runtime_error(std::string(module) + "." + function + " has the signature '" + signature +
                               "', expected " + std::to_string(arguments) +
                               " pointers with integers of 32 bits; this build of SciPy is not supported");
    return PyCapsule_GetPointer(capsule.ptr(), name);
  }
};

}  // namespace pneumorph
