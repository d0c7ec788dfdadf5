// How a regulator's pressure moves towards its command: at a limited rate, or at rates of its own in each cell of
// pressure, as air flows. Equations (33) and (41) of docs/physics.md; pneumorph/physics/regulators.py is the same in Python.
#pragma once
#include <cmath>

#include "model.hpp"

namespace pneumorph {
namespace PNEUMORPH_INSTRUCTION_SET {

inline double risen(double p, double command, const double* rates, int cells, double width, double left) {
  for (int cell = std::fmax(int(p / width), 0); cell < cells; ++cell) {
    const double end = std::fmin((cell + 1) * width, command);
    if (end - p > rates[cell] * left) return p + rates[cell] * left;
    left -= std::fmax(end - p, 0.0) / rates[cell];  // rounding may have put p behind the cell's end
    p = std::fmax(p, end);
    if (p >= command) break;
  }
  return p;
}

inline double fallen(double p, double command, const double* rates, int cells, double width, double left) {
  for (int cell = std::fmin(int(p / width), cells - 1); cell >= 0; --cell) {
    const double end = std::fmax(cell * width, command);
    if (p - end > rates[cell] * left) return p - rates[cell] * left;
    left -= std::fmax(p - end, 0.0) / rates[cell];
    p = std::fmin(p, end);
    if (p <= command) break;
  }
  return p;
}

// Pressure of regulator i of a robot after a time step.
inline double regulated_after(const Settings& settings, const RobotModel& robot, int i, double p, double command) {
  const int cells = settings.pressure_cells;
  if (cells > 0) {
    const double* rising = robot.pressure_rates + 2 * i * cells;
    return command > p ? risen(p, command, rising, cells, settings.pressure_cell, settings.time_step)
                       : fallen(p, command, rising + cells, cells, settings.pressure_cell, settings.time_step);
  }
  const double most = settings.pressure_rate * settings.time_step;
  const double change = command - p;
  return p + (change > most ? most : (change < -most ? -most : change));
}

}  // namespace PNEUMORPH_INSTRUCTION_SET
}  // namespace pneumorph
