"""The ten published pairs of real and simulated pressure, as `pneumorph calibrate` reads them."""

PAPER_PAIRS = """real_pressure_kPa,simulated_pressure_kPa
10,29.54
20,65.67
30,93.51
40,128.17
50,178.47
60,224.37
70,277.59
80,316.16
90,343.51
100,382.57
"""
