"""The explicit symbolic form of a model: what FMUs are generated from and what fits differentiate."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import casadi as ca


@dataclass(frozen=True)
class Variable:
    """One scalar variable of a model.

    `unit` is the Modelica unit string (`"N.m"`, `"rad/s"`, `"1"`), empty when none was declared.
    `start` is the value of a parameter, or the start value of an input or a state at default parameters.
    """

    name: str
    unit: str = ""
    description: str = ""
    start: float | None = None
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None


@dataclass(frozen=True)
class Remembered:
    """Numbers m that change at events only, from `pre`, `when`, `sample` and `reinit`.

    * `start(t, p) -> m`: what they begin with
    * `due(m) -> times`: s, when each clock ticks next
    * `update(t, x, u, d, p, c) -> (m, x)`: what they, and the states by `reinit`, become once the relations have their sides

    `resets` tells whether states can change.
    """

    names: tuple[str, ...]
    resets: bool
    start: ca.Function
    due: ca.Function
    update: ca.Function


@dataclass(frozen=True)
class KeptInputs:
    """What a model keeps from event to event, as inputs that stand still between events.

    * `start(t, p) -> m`: what they begin with
    * `update(t, x, u, d, p) -> m`: what they become at an event; they are among u themselves
    """

    names: tuple[str, ...]
    start: ca.Function
    update: ca.Function


@dataclass(frozen=True)
class Relations:
    """A model whose relations keep their side, given by c (1 where a relation holds, else 0), until an event.

    The first relations have an event indicator; the last ones change at a known time and depend on nothing else.

    * `rhs(t, x, u, d, p, c) -> (dx, z)`
    * `indicators(t, x, u, d, p, c) -> (g, size)`: a relation holds where its g is positive; size is that of the
      numbers compared
    * `times(p) -> (time, rising)`: s, and 1 where the relation becomes true, 0 where it becomes false

    `memory` is what is kept from event to event; it stands behind the sides in c.

    `names` say how each relation reads and where it stands; `holds_at_zero` tells >= and <= from > and <.
    """

    names: tuple[str, ...]
    holds_at_zero: tuple[bool, ...]
    rhs: ca.Function
    indicators: ca.Function
    times: ca.Function
    memory: Remembered | None = None

    @property
    def n_indicators(self) -> int:
        """Number of event indicators."""
        return int(self.indicators.numel_out(0))


@dataclass(frozen=True)
class SymbolicSystem:
    """A model as explicit CasADi functions of column vectors, in the order of the variable tuples.

    With t the time in s, x the states, u the inputs, p the parameters, z the algebraic variables and
    d the values of the delay operators (`d[i](t) = source[i](t - delay[i])`):

    * `rhs(t, x, u, d, p) -> (dx, z)`
    * `history(t, u, p) -> (source, delay)`: what each delay operator remembers, and for how long (s);
      sources depend on inputs, time and parameters only. Before the start of a run a source is taken
      to have had its initial value.
    * `dependent(p) -> values` of the dependent parameters
    * `initial(p) -> s`: the declared start values of the states
    * `consistent(t, u, p, s) -> x0`: the start values that satisfy all initial conditions, from those declared or set;
      None if every s holds as it is

    `settings` holds the structural parameters (Boolean, Integer, String), fixed when the model was built.
    `outputs` names the interface of the model: each is one of `states` or `algebraics`.
    `solved` lists the unknowns of each block of equations that `rhs` solves by iteration, in the order of evaluation;
    they are NaN where no solution was found. Names that are none of the variables are derivatives or auxiliaries.
    `notes` tell what was assumed where the model leaves a choice.
    `contacts` tells whether it makes and breaks contact, so that steps of one length err wherever it does.
    `relations` makes events of those relations that Modelica makes events of; `rhs` evaluates them as they stand.
    `kept` are inputs that stand for what the model keeps from event to event; None if it keeps nothing, or `relations` does.
    """

    name: str
    description: str
    inputs: tuple[Variable, ...]
    states: tuple[Variable, ...]
    algebraics: tuple[Variable, ...]
    parameters: tuple[Variable, ...]
    dependents: tuple[Variable, ...]
    outputs: tuple[str, ...]
    rhs: ca.Function
    history: ca.Function
    dependent: ca.Function
    initial: ca.Function
    settings: Mapping[str, bool | float | str] = field(default_factory=dict)
    solved: tuple[tuple[str, ...], ...] = ()
    consistent: ca.Function | None = None
    notes: tuple[str, ...] = ()
    relations: Relations | None = None
    contacts: bool = False
    kept: KeptInputs | None = None

    def start_of_states(self, parameters: ca.DM, inputs: ca.DM | None = None, time: float = 0.0) -> ca.DM:
        """Start values of the states at given parameters; inputs have their own start values unless given.

        Args:
            parameters: values of all parameters.
            inputs: values of the inputs.
            time: in s.
        """
        declared = self.initial(parameters)
        if self.consistent is None:
            return declared
        u = ca.DM([v.start or 0.0 for v in self.inputs]) if inputs is None else inputs
        return self.consistent(time, u, parameters, declared)

    @property
    def between_events(self) -> ca.Function:
        """`rhs`, of `(t, x, u, d, p, c)` where relations and memories keep what they are until an event."""
        return self.rhs if self.relations is None else self.relations.rhs

    @property
    def remembers(self) -> bool:
        """Whether values are kept from event to event, which `rhs` does not know: there they are what they start with."""
        return self.relations is not None and self.relations.memory is not None

    @property
    def jumps(self) -> bool:
        """Whether states can become other ones at an event, or relations have to take sides before the equations have a solution."""
        memory = None if self.relations is None else self.relations.memory
        return memory is not None and (memory.resets or not memory.names)

    @property
    def n_delays(self) -> int:
        """Number of delay operators."""
        return int(self.history.numel_out(0))
