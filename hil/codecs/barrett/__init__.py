"""The protocol of Barrett's motor controllers (pucks), force/torque sensor and safety module on CAN.

Facts are those of the public library libbarrett (names, numbers, layouts); where they are uncertain, the functions take
what is uncertain as a parameter.
"""
