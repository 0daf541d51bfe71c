//! Readers and writers of the Ikiru inverse-kinematics library: glTF, poses as JSON, built-in rigs.
