"""The description of trials of a drive whose torque is measured with noise, for tests that write such trials."""


def described(angle_std: float, torque_std: float) -> str:
    """The `case.toml` of two learning trials and a held-out one, with the noise (rad, N.m) that their sensors declare."""
    return f"""files = ["a.csv", "b.csv", "c.csv"]
learning = [1, 2]
held_out = [3]
[columns]
time = "s"
torque = "N.m"
phi = "rad"
[sensors]
phi_noise_std_rad = {angle_std}
"torque_noise_std_N.m" = {torque_std}
"""
