"""How people see results: terminal tables, figures and self-contained pages."""
