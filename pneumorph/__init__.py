"""pneumorph designs pneumatic soft robots and teaches them to move.

Units inside the package are millimetre, kilogram, second, millinewton and kilopascal.
"""

__version__ = "0.1.0"
