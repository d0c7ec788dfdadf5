"""Files of other programs: sorotraj gaits, SOFA scenes and reductions."""
