"""The film: material, network of springs, kinematics, specimen, its reading."""
