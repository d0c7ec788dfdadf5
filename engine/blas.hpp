// The BLAS that SciPy carries, called through the function pointers of its Cython interface
// (scipy.linalg.cython_blas and cython_lapack): full speed, and no library to find at build time.
#pragma once
#include <nanobind/nanobind.h>

#include <stdexcept>
#include <string>

namespace pneumorph {

struct Blas {
  using Potrf = void (*)(char* uplo, int* n, double* a, int* lda, int* info);
  using Trsm = void (*)(char* side, char* uplo, char* trans, char* diag, int* m, int* n, double* alpha,
                        double* a, int* lda, double* b, int* ldb);
  using Syrk = void (*)(char* uplo, char* trans, int* n, int* k, double* alpha, double* a, int* lda,
                        double* beta, double* c, int* ldc);
  using Gemm = void (*)(char* trans_a, char* trans_b, int* m, int* n, int* k, double* alpha, double* a,
                        int* lda, double* b, int* ldb, double* beta, double* c, int* ldc);

  // A = L L^T in the lower triangle; the order of the first minor that is not positive, or 0.
  int factorise(int n, double* a, int lda) const {
    char lower = 'L';
    int info = 0;
    potrf(&lower, &n, a, &lda, &info);
    return info;
  }
  // B <- B L^-T (transposed) or B L^-1, B of (m, n).
  void solve_right(bool transposed, int m, int n, const double* l, int ldl, double* b, int ldb) const {
    char side = 'R', lower = 'L', trans = transposed ? 'T' : 'N', diag = 'N';
    double one = 1.0;
    trsm(&side, &lower, &trans, &diag, &m, &n, &one, const_cast<double*>(l), &ldl, b, &ldb);
  }
  // C <- C + alpha A A^T in the lower triangle, A of (n, k).
  void add_square(int n, int k, double alpha, const double* a, int lda, double* c, int ldc) const {
    char lower = 'L', trans = 'N';
    double one = 1.0;
    syrk(&lower, &trans, &n, &k, &alpha, const_cast<double*>(a), &lda, &one, c, &ldc);
  }
  // C <- beta C + alpha A op(B), A of (m, k), C of (m, n).
  void multiply(bool transpose_b, int m, int n, int k, double alpha, const double* a, int lda, const double* b,
                int ldb, double beta, double* c, int ldc) const {
    char plain = 'N', trans_b = transpose_b ? 'T' : 'N';
    gemm(&plain, &trans_b, &m, &n, &k, &alpha, const_cast<double*>(a), &lda, const_cast<double*>(b), &ldb, &beta,
         c, &ldc);
  }

  static const Blas& of_scipy() {
    static const Blas blas = {
        reinterpret_cast<Potrf>(pointer("scipy.linalg.cython_lapack", "dpotrf", 5)),
        reinterpret_cast<Trsm>(pointer("scipy.linalg.cython_blas", "dtrsm", 11)),
        reinterpret_cast<Syrk>(pointer("scipy.linalg.cython_blas", "dsyrk", 10)),
        reinterpret_cast<Gemm>(pointer("scipy.linalg.cython_blas", "dgemm", 13)),
    };
    return blas;
  }

  Potrf potrf;
  Trsm trsm;
  Syrk syrk;
  Gemm gemm;

 private:
  // A capsule is named by its C signature: its integers must be ours, and its arguments as many.
  static void* pointer(const char* module, const char* function, int arguments) {
    nanobind::object table = nanobind::module_::import_(module).attr("__pyx_capi__");
    nanobind::object capsule = table[function];
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
