#include <nanobind/nanobind.h>
NB_MODULE(_engine, module) { module.doc() = "Batched reduced-order stepper."; }
