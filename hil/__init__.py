"""The bench: sessions with a robot on CAN. Nothing is here yet."""
