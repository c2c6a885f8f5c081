"""Wires to robots: every interface of python-can behind one narrow class."""
