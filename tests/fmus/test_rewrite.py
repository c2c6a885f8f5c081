"""What the compiler reads instead of declarations that it misreads."""

from fmus.frontend.rewrite import rewritten

CLUTCH = """model Clutch
  parameter Real mu_pos[:, 2] = [0, 0.5];
  parameter Real peak = 1;
protected
  final parameter ExternalCombiTable1D tableID = ExternalCombiTable1D(table=mu_pos);
  final parameter Real mu0 =
    getTable1DValue(tableID, 1, 0) "at rest";
  parameter Real low = 1e-4*mu0, other = 2;
  parameter Real least(unit="1") = peak*mu0;
public
  Real mu = mu0;
  Real two[2] = {mu0, 1};
equation
  mu0*peak = der(x);
end Clutch;
"""


def test_a_value_from_a_table_becomes_an_equation_and_so_does_what_needs_it() -> None:
    text = rewritten(CLUTCH, "Clutch.mo")
    assert "  Real mu0 \n" in text and "equation mu0 = getTable1DValue ( tableID , 1 , 0 ); protected" in text
    assert 'Real least(unit="1") ; equation least = peak * mu0; protected' in text
    assert "Real mu ; equation mu = mu0; public" in text


def test_what_shares_its_declaration_or_is_an_array_stays() -> None:
    text = rewritten(CLUTCH, "Clutch.mo")
    assert "parameter Real low = 1e-4*mu0, other = 2;" in text and "Real two[2] = {mu0, 1};" in text


def test_every_line_stays_where_it_is() -> None:
    lines = rewritten(CLUTCH, "Clutch.mo").split("\n")
    assert len(lines) == len(CLUTCH.split("\n")) and lines[13] == "  mu0*peak = der(x);"


def test_a_text_without_tables_is_left_alone() -> None:
    text = "model M\n  parameter Real a = f(b);\nend M;\n"
    assert rewritten(text, "M.mo") == text


def test_the_ends_of_a_table_follow_its_rows() -> None:
    """The compiler makes a number of them, which does not change with the rows."""
    text = rewritten(
        "block T\n  parameter Boolean tableOnFile=false;\n  parameter Real table[:, :];\n  parameter ExternalCombiTable1D tableID"
        " = ExternalCombiTable1D(table);\n  final parameter Real low = Internal.getTable1DAbscissaUmin(tableID);\nend T;\n",
        "T.mo",
    )
    known = (
        "if tableOnFile then Internal . getTable1DAbscissaUmin ( tableID ) else sum(table[1:min(1, size(table, 1)), 1])"
    )
    assert f"equation low = ({known}); public" in text
