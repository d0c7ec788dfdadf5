#!/usr/bin/env bash
# The engine's tests with its address and undefined-behaviour sanitizers, in an installation of its own:
#
#   engine/sanitize.sh [.venv/bin/python]
#
# Minutes, nearly all of it compilation. Ends with pytest's closing line, or a sanitizer's report.
set -euo pipefail
cd "$(dirname "$0")/.."
python=${1:-.venv/bin/python}
packages=$("$python" -c 'import sysconfig; print(sysconfig.get_paths()["purelib"])')

CMAKE_BUILD_PARALLEL_LEVEL=${CMAKE_BUILD_PARALLEL_LEVEL:-1} \
  "$python" -m pip install --quiet --no-build-isolation --no-deps --upgrade --target .cache/sanitized \
  -C cmake.define.PNEUMORPH_SANITIZE=ON -C build-dir=.cache/engine-sanitized .

# -P, -S: neither this tree nor its editable installation must be found first. Python itself leaks on purpose at its end.
LD_PRELOAD="$(c++ -print-file-name=libasan.so) $(c++ -print-file-name=libubsan.so)" \
  ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1 OPENBLAS_NUM_THREADS=1 \
  PYTHONPATH="$PWD/.cache/sanitized:$packages" \
  "$python" -P -S -m pytest -q -p no:cacheprovider -o pythonpath="tests" \
  tests/simulation tests/fem/test_friction_problem.py tests/fem/test_frontal_cholesky.py
