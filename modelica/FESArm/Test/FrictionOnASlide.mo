within FESArm.Test;
model FrictionOnASlide "A sliding mass slows down by each law of friction as its closed form says"
  import SI = FESArm.Units;
  parameter SI.Velocity v0 = 0.2 "Speed of the mass with dry friction at the start";
  parameter SI.Velocity v1 = 3 "Speed of the mass with drag at the start";
  parameter SI.Damping b = 0.6 "Viscous friction";
  parameter SI.Mass m = 1.5 "Mass of each slide";
  FESArm.Plants.LinearDrive viscous(
    redeclare model Force1 = FESArm.Effects.Force.LinearViscousFriction,
    force1(b={0.6}));
  FESArm.Effects.Force.LinearCoulombFriction dry(fC={0.3}, vSharp=0.05);
  FESArm.Effects.Force.LinearDrag drag(c={0.75});
  SI.Velocity vDry(start=v0, fixed=true) "Speed under dry friction";
  SI.Velocity vDrag(start=v1, fixed=true) "Speed under drag";
  FESArm.Effects.Force.LinearStribeckFriction stribeck(n=3, fC={0.2, 0.2, 0.2}, fExtra={0.3, 0.3, 0.3}, vS=0.5);
  output SI.Velocity viscousError "Zero when the law is right";
  output SI.Velocity dryError "Zero when the law is right";
  output SI.Velocity dragError "Zero when the law is right";
  output SI.Force stribeckError "Zero when the law is right";
protected
  SI.Factor z "sinh(v/vSharp) of the mass with dry friction";
equation
  viscous.force = 1.2;
  viscous.correction_x = 0;
  dry.x = {0};
  dry.v = {vDry};
  dry.a = {0};
  m*der(vDry) = dry.f[1];
  drag.x = {0};
  drag.v = {vDrag};
  drag.a = {0};
  m*der(vDrag) = drag.f[1];
  viscousError = viscous.v - viscous.force/b*(1 - exp(-b*time/viscous.m));
  z = sinh(v0/dry.vSharp)*exp(-dry.fC[1]*time/(m*dry.vSharp));
  dryError = vDry - dry.vSharp*log(z + sqrt(z^2 + 1));
  dragError = vDrag - v1/(1 + drag.c[1]*v1*time/m);
  stribeck.x = {0, 0, 0};
  stribeck.v = {20, 0.5, -0.5};
  stribeck.a = {0, 0, 0};
  stribeckError = abs(stribeck.f[1] + 0.2) + abs(stribeck.f[2] + 0.2 + 0.3/exp(1)) + abs(stribeck.f[3] - 0.2 - 0.3/exp(1));
  annotation (experiment(StopTime=2), Documentation(info="<html>
<p>A force F against viscous friction b: v = F/b (1 - exp(-b t/m)). Dry friction alone: sinh(v/vSharp) falls as
exp(-fC t/(m vSharp)). Drag alone: v = v0/(1 + c v0 t/m). Stribeck friction: at 40 vS only fC is left, at vS the extra part
has fallen to 1/e.</p></html>"));
end FrictionOnASlide;
