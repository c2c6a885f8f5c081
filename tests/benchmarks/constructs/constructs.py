"""Small models, one for each language construct, with values from algebra: what the construct means, worked out by hand."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Construct:
    """A model `M` and the value of `y` or `der(x)` at the start, at time 0.3 with inputs at 0.5."""

    name: str
    text: str
    variable: str
    value: float


X = "Real x(start=2, fixed=true);"
Y = "output Real y;"
RATE = "der(x) = -x;"


def _y(name: str, declarations: str, equations: str, value: float, before: str = "") -> Construct:
    return Construct(
        name, f"{before}\nmodel M\n  {X} {Y} {declarations}\nequation\n  {RATE}\n  {equations}\nend M;\n", "y", value
    )


def _rate(name: str, declarations: str, equations: str, value: float, before: str = "") -> Construct:
    return Construct(
        name, f"{before}\nmodel M\n  {X} {declarations}\nequation\n  {equations}\nend M;\n", "der(x)", value
    )


LAW = (
    "partial model Law Real s; Real f; end Law; model Lin extends Law; parameter Real k=1; equation f = k*s; end Lin;"
    "model Cub extends Law; parameter Real k=1; equation f = k*s^3; end Cub;"
    "model Base replaceable model L = Lin constrainedby Law; L law; Real s(start=2); equation law.s = s; der(s) = -law.f; end Base;"
)
PIN = (
    "connector Pin Real v; flow Real i; end Pin; model R parameter Real R=2; Pin a, b; equation a.v - b.v = R*a.i; a.i + b.i = 0;"
    " end R; model C parameter Real C=3; Pin a, b; Real v(start=2, fixed=true); equation v = a.v - b.v; C*der(v) = a.i;"
    " a.i + b.i = 0; end C; model G Pin a; equation a.v = 0; end G;"
)
CIRCUIT = "R r; C c; G g; equation connect(r.a, c.a); connect(r.b, g.a); connect(c.b, g.a);"

CONSTRUCTS = (
    _rate("force balance, storage on the left", "parameter Real m=4;", "m*der(x) = -3*x;", -1.5),
    _rate("force balance, storage on the right", "parameter Real m=4;", "-3*x = m*der(x);", -1.5),
    _rate("acceleration by name", "Real a;", "a = der(x); 4*a = -3*x;", -1.5),
    _rate("der(der(x)) by two variables", "Real v(start=5, fixed=true);", "der(x) = v; der(v) = -x;", 5.0),
    _rate("der(der(x))", "", "der(der(x)) = -x;", 0.0),
    _rate("der of an expression", "", "der(x^2) = -x;", -0.5),
    _y("input with a start", "input Real u(start=0.5);", "y = 3*u;", 1.5),
    _y("input array", "input Real u[2](each start=0.5);", "y = u[1] + 2*u[2];", 1.5),
    _y("time", "", "y = 2*time;", 0.6),
    _y("parameter expression", "parameter Real a=2; parameter Real b=a^2+1;", "y = b*x;", 10.0),
    _y("final parameter", "final parameter Real a=2;", "y = a*x;", 4.0),
    _y("constant", "constant Real a=3;", "y = a*x;", 6.0),
    _y(
        "enumeration parameter",
        "type E = enumeration(a, b); parameter E e=E.b;",
        "y = if e == E.b then 3*x else x;",
        6.0,
    ),
    _y(
        "Boolean parameter and if equation",
        "parameter Boolean on=true;",
        "if on then y = 2*x; else y = x; end if;",
        4.0,
    ),
    _y("Integer parameter as a size", "parameter Integer n=3; Real v[n];", "v = {i*x for i in 1:n}; y = sum(v);", 12.0),
    _y("if expression", "", "y = if x > 1 then x^2 else -x;", 4.0),
    _y("if equation on a variable", "", "if x > 1 then y = x^2; else y = -x; end if;", 4.0),
    _y("noEvent", "", "y = noEvent(if x > 1 then x^2 else -x);", 4.0),
    _y("smooth", "", "y = smooth(0, if x > 1 then x^2 else -x);", 4.0),
    _y("homotopy", "", "y = homotopy(x^2, x);", 4.0),
    _y("semiLinear", "", "y = semiLinear(x, 3, 5);", 6.0),
    _y("min and max", "", "y = min(x, 1.5) + max(x, 3);", 4.5),
    _y("abs, sign, sqrt", "", "y = abs(-x) + sign(x) + sqrt(x + 2);", 5.0),
    _y(
        "trigonometric functions",
        "",
        "y = sin(x) + cos(x) + tan(x) + atan2(x, 3);",
        math.sin(2) + math.cos(2) + math.tan(2) + math.atan2(2, 3),
    ),
    _y(
        "exponential functions",
        "",
        "y = exp(-x) + log(x) + log10(x) + tanh(x);",
        math.exp(-2) + math.log(2) + math.log10(2) + math.tanh(2),
    ),
    _y("div, mod, rem", "", "y = div(-7.0, x) + mod(-7.0, x) + rem(-7.0, x);", -3 + 1 - 1),
    _y("floor, ceil, integer", "", "y = floor(x + 0.5) + ceil(x + 0.5) + integer(x + 0.5);", 7.0),
    _y("algebraic loop, linear", "Real z;", "y + z = x; y - z = 1;", 1.5),
    _y("algebraic loop, nonlinear", "", "y + y^3 = 5*x;", 2.0),
    Construct(
        "algorithm limiter",
        f"model M\n  {X} {Y}\nequation\n  {RATE}\nalgorithm\n  y := x;\n  if y > 1.5 then\n    y := 1.5;\n  end if;\nend M;\n",
        "y",
        1.5,
    ),
    Construct(
        "algorithm of several variables",
        f"model M\n  {X} {Y} Real a; Boolean on;\nequation\n  {RATE}\nalgorithm\n  a := 3*x;\n  on := a > 5;\n  a := if on then 5 else a;\n"
        "  y := 3*a;\nend M;\n",
        "y",
        15.0,
    ),
    _y(
        "function with a loop",
        "",
        "y = power3(x);",
        8.0,
        "function power3 input Real u; output Real r; algorithm r := 1; for i in 1:3 loop r := r*u; end for; end power3;",
    ),
    _y(
        "function with an if",
        "",
        "y = cut(x);",
        1.0,
        "function cut input Real u; output Real r; algorithm if u > 1 then r := 1; else r := u; end if; end cut;",
    ),
    _y(
        "function with two outputs",
        "Real z;",
        "(y, z) = both(x);",
        4.0,
        "function both input Real u; output Real a; output Real b; algorithm a := u^2; b := u; end both;",
    ),
    _y(
        "function with defaults and names",
        "",
        "y = scaled(x, k=3);",
        6.0,
        "function scaled input Real u; input Real k=2; output Real r; algorithm r := k*u; end scaled;",
    ),
    _y(
        "external C function",
        "",
        "y = ext(x);",
        2.0,
        'function ext input Real u; output Real r; external "C" r = fabs(u); end ext;',
    ),
    _y(
        "another name of a built-in function",
        "",
        "y = sine(x);",
        math.sin(2.0),
        'function sine input Real u; output Real r; external "builtin" r = sin(u); end sine;',
    ),
    _y(
        "matrix times vector",
        "parameter Real A[2,2]={{1,2},{3,4}}; Real v[2];",
        "v = A*{x, 1}; y = v[1] + v[2];",
        4 + 10,
    ),
    _y("transpose, identity, cross", "Real v[3];", "v = transpose(identity(3))*cross({1,0,0},{0,x,0}); y = v[3];", 2.0),
    _y("array slice", "parameter Real a[4]={1,2,3,4};", "y = sum(a[2:3])*x;", 10.0),
    _y("end in a subscript", "parameter Real a[4]={1,2,3,4};", "y = a[end]*x;", 8.0),
    _y("for equation", "Real v[3];", "for i in 1:3 loop v[i] = i*x; end for; y = v[3];", 6.0),
    _y("elementwise operators", "", "y = sum({1,2} .* {x,x});", 6.0),
    _rate(
        "component",
        "A a; ",
        "a.u = x; der(x) = -a.y;",
        -6.0,
        "model A parameter Real k=3; Real u; Real y; equation y = k*u; end A;",
    ),
    _rate(
        "component with a modifier",
        "A a(k=5); ",
        "a.u = x; der(x) = -a.y;",
        -10.0,
        "model A parameter Real k=3; Real u; Real y; equation y = k*u; end A;",
    ),
    _rate(
        "component array with a modifier",
        "A a[2](k={5,7}); ",
        "a.u = {x, x}; der(x) = -a[2].y;",
        -14.0,
        "model A parameter Real k=3; Real u; Real y; equation y = k*u; end A;",
    ),
    _rate(
        "each",
        "A a[2](each k=5); ",
        "a.u = {x, x}; der(x) = -a[2].y;",
        -10.0,
        "model A parameter Real k=3; Real u; Real y; equation y = k*u; end A;",
    ),
    _rate(
        "inner and outer",
        "inner Real g=3; A a;",
        "der(x) = -a.y;",
        -3.0,
        "model A outer Real g; Real y; equation y = g; end A;",
    ),
    _rate(
        "inner and outer component",
        "inner World world(k=2); A a;",
        "world.g = 3; der(x) = -a.y;",
        -6.0,
        "model World Real g; parameter Real k=1; end World; model A outer World world; Real y; equation y = world.k*world.g; end A;",
    ),
    _rate(
        "conditional component",
        "parameter Boolean on=false; A a if on;",
        "der(x) = -x;",
        -2.0,
        "model A Real y; equation y = 1; end A;",
    ),
    Construct(
        "extends with a modifier",
        "model B parameter Real k=1; Real x(start=2, fixed=true); equation der(x) = -k*x; end B; model M extends B(k=3); end M;",
        "der(x)",
        -6.0,
    ),
    Construct(
        "extends twice",
        "partial model A Real x(start=2, fixed=true); Real f; equation der(x) = f; end A; model B extends A; equation f = -3*x; end B; model M extends B; end M;",
        "der(x)",
        -6.0,
    ),
    Construct(
        "redeclare model in extends", f"{LAW} model M extends Base(redeclare model L = Cub); end M;", "der(s)", -8.0
    ),
    Construct(
        "redeclare model with a modifier in extends",
        f"{LAW} model M extends Base(redeclare model L = Cub(k=5)); end M;",
        "der(s)",
        -40.0,
    ),
    Construct(
        "redeclare model with a modifier in a component",
        f"{LAW} model M Base b(redeclare model L = Cub(k=5)); end M;",
        "der(b.s)",
        -40.0,
    ),
    Construct(
        "redeclare with a modifier of the part",
        f"{LAW} model M extends Base(redeclare model L = Cub, law(k=5)); end M;",
        "der(s)",
        -40.0,
    ),
    Construct(
        "redeclare in the body with a modifier",
        f"{LAW} model M extends Base; redeclare model L = Cub(k=5); end M;",
        "der(s)",
        -40.0,
    ),
    Construct(
        "short class with a modifier",
        f"{LAW} model M5 = Cub(k=5); model M extends Base(redeclare model L = M5); end M;",
        "der(s)",
        -40.0,
    ),
    Construct(
        "modifiers of constrainedby",
        "partial model P Real f; parameter Real k=1; end P; model A extends P; equation f = k; end A; model Base replaceable model L = A constrainedby P(k=7); L law; Real x(start=2); equation der(x) = -law.f; end Base; model M extends Base(redeclare model L = A); end M;",
        "der(x)",
        -7.0,
    ),
    Construct(
        "modifier of a name that does not exist",
        "model B parameter Real k=1; Real x(start=2); equation der(x) = -k*x; end B; model M extends B(kk=3); end M;",
        "der(x)",
        math.nan,
    ),
    Construct("connect with flow", f"{PIN} model M {CIRCUIT} end M;", "der(c.v)", -2 / 6),
    Construct(
        "unconnected flow is zero", f"{PIN} model M C c; G g; equation connect(c.b, g.a); end M;", "der(c.v)", 0.0
    ),
    Construct(
        "array of connectors",
        f"{PIN} model M R r[2]; C c; G g; equation for i in 1:2 loop connect(r[i].a, c.a); connect(r[i].b, g.a); end for; connect(c.b, g.a); end M;",
        "der(c.v)",
        -2 / 3,
    ),
    Construct(
        "signal connectors",
        "connector In = input Real; connector Out = output Real; block K In u; Out y; equation y = 3*u; end K; model M Real x(start=2); K k; equation k.u = x; der(x) = -k.y; end M;",
        "der(x)",
        -6.0,
    ),
    Construct(
        "expandable connector",
        "expandable connector Bus end Bus; model M Bus b; Real x(start=2); equation b.s = x; der(x) = -b.s; end M;",
        "der(x)",
        -2.0,
    ),
    Construct(
        "rigidly coupled inertias",
        "model I parameter Real J; Real w(start=2); Real t; equation J*der(w) = t; end I; model M I a(J=2), b(J=3); equation a.w = b.w; a.t + b.t = -a.w; end M;",
        "a.t",
        -0.8,
    ),
    Construct(
        "record variable",
        "record P Real a; Real b; end P; model M Real x(start=2); P p; equation p.a = x; p.b = 2*p.a; der(x) = -p.b; end M;",
        "der(x)",
        -4.0,
    ),
    Construct(
        "record parameter",
        "record P parameter Real a=3; end P; model M parameter P p(a=4); Real x(start=2); equation der(x) = -p.a*x; end M;",
        "der(x)",
        -8.0,
    ),
    Construct(
        "package constant and import",
        "package P constant Real g=3; end P; model M import P.g; Real x(start=2); equation der(x) = -g*x; end M;",
        "der(x)",
        -6.0,
    ),
    Construct(
        "renaming import",
        "package P package Q constant Real g=3; end Q; end P; model M import S = P.Q; Real x(start=2); equation der(x) = -S.g*x; end M;",
        "der(x)",
        -6.0,
    ),
    Construct(
        "own types",
        'type Mass = Real(unit="kg", min=0); model M parameter Mass m=4; Real x(start=2); equation m*der(x) = -3*x; end M;',
        "der(x)",
        -1.5,
    ),
    Construct(
        "units that disagree",
        'model M parameter Real l(unit="m")=4; parameter Real t(unit="s")=1; Real x(start=2); equation der(x) = l + t; end M;',
        "der(x)",
        math.nan,
    ),
    Construct(
        "quoted name",
        "model M Real 'x y'(start=2); Real x(start=2); equation der('x y') = -1; der(x) = -'x y'; end M;",
        "der(x)",
        -2.0,
    ),
    Construct(
        "initial equation",
        "model M Real x; equation der(x) = 4 - x^2 + 0*time; initial equation der(x) = 0; end M;",
        "der(x)",
        0.0,
    ),
    Construct(
        "parameter fixed=false",
        "model M parameter Real k(fixed=false, start=1); Real x(start=2, fixed=true); equation der(x) = -k*x; initial equation k*x = 6; end M;",
        "der(x)",
        -6.0,
    ),
    Construct(
        "StateSelect.always of a variable without a derivative",
        "model M Real x(start=2, stateSelect=StateSelect.always); Real z; equation z = 2*x; der(z) = -x; end M;",
        "der(x)",
        math.nan,
    ),
    _y("delay of an input", "input Real u(start=0.5);", "y = delay(u, 0.1);", math.nan),
    _y("delay of a state", "", "y = delay(x, 0.1);", math.nan),
    _y("Boolean variable", "Boolean b;", "b = x > 1; y = if b then 3 else 1;", 3.0),
    _y("Integer variable", "Integer n;", "n = if x > 1 then 3 else 1; y = n*x;", 6.0),
    _rate("assert that holds", "parameter Real k=3;", 'der(x) = -k*x; assert(k > 0, "k");', -6.0),
    _rate("assert that does not hold", "parameter Real k=-3;", 'der(x) = -k*x; assert(k > 0, "k");', math.nan),
    _rate(
        "when with a discrete variable",
        "discrete Real s(start=1, fixed=true);",
        "der(x) = -s; when x < 1 then s = 2; end when;",
        -1.0,
    ),
    _rate("reinit", "", "der(x) = -1; when x < 1 then reinit(x, 2); end when;", -1.0),
    _rate(
        "pre",
        "Boolean b(start=false, fixed=true);",
        "b = x > 3 or pre(b) and x > 1; der(x) = if b then -1 else 1;",
        1.0,
    ),
    _rate(
        "sample",
        "discrete Real s(start=1, fixed=true);",
        "der(x) = -s; when sample(0, 0.1) then s = x; end when;",
        -2.0,
    ),
    _rate("terminate", "", 'der(x) = -1; when x < 0 then terminate("end"); end when;', -1.0),
    _rate("initial()", "Real k;", "k = if initial() then 1 else 2; der(x) = -k*x;", -4.0),
    _y("String parameter", 'parameter String s="a";', 'y = if s == "a" then x else 0;', 2.0),
    _y("spatialDistribution", "", "(y, ) = spatialDistribution(x, 0, time, true, {0, 1}, {0, 0});", math.nan),
)
