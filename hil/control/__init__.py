"""What decides in a cycle of a session: controllers, the pilot that asks them and the safety core, and its clock."""
