//! Objectives and solvers of the Ikiru inverse-kinematics library.
