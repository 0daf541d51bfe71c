//! Scenario files of the Ikiru inverse-kinematics library: text to rig, problem and solver.
