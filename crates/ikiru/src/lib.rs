//! Real-time inverse kinematics for virtual humans and any other rig.
