model Delay "Pure delay"
  parameter Real T(unit="s", min=0, max=100) = 0.01 "Delay";
  input Real u "Signal";
  output Real y "= u(t - T)";
equation
  y = delay(u, T, 100.0);
end Delay;

model Lag "First-order lag"
  parameter Real T(unit="s", min=0.0005, max=0.5) = 0.02 "Time constant";
  input Real u "Signal";
  output Real y(start=0, fixed=false) "T der(y) = u - y";
initial equation
  y = u;
equation
  der(y) = (u - y)/T;
end Lag;

model Gain "Scale error"
  parameter Real k = 1 "Gain";
  input Real u "Signal";
  output Real y "= k u";
equation
  y = k*u;
end Gain;

model Offset "Zero error"
  parameter Real c = 0 "Offset";
  input Real u "Signal";
  output Real y "= u + c";
equation
  y = u + c;
end Offset;

model Ceiling "Saturation on both sides"
  parameter Real limit = 1 "Largest magnitude";
  input Real u "Signal";
  output Real y "u kept within -limit and limit";
equation
  y = noEvent(max(-limit, min(limit, u)));
end Ceiling;

model DeadZone "Nothing happens below a threshold"
  parameter Real threshold = 0 "Magnitude below which the output is zero";
  input Real u "Signal";
  output Real y "u moved towards zero by the threshold";
equation
  y = noEvent(max(0, u - threshold) + min(0, u + threshold));
end DeadZone;

model Share "Error of a parameter as a share of its value, applied before a run begins"
  parameter Real share = 0 "Error";
  input Real u "Value of the parameter";
  output Real y "= u (1 + share)";
equation
  y = u*(1 + share);
end Share;

model ConstantForce "Steady force"
  parameter Real f0 = 0 "Force";
  input Real q "Position";
  input Real w "Speed";
  output Real f "= f0";
equation
  f = f0;
end ConstantForce;

model ViscousFriction "Friction in proportion to speed"
  parameter Real b = 0 "Damping";
  input Real q "Position";
  input Real w "Speed";
  output Real f "= -b w";
equation
  f = -b*w;
end ViscousFriction;

model CoulombFriction "Friction of constant size, smooth near rest"
  parameter Real fC = 0 "Size";
  parameter Real wSharp = 0.01 "Speed at which 76 % of the full size is reached";
  input Real q "Position";
  input Real w "Speed";
  output Real f "= -fC tanh(w/wSharp)";
equation
  f = -fC*tanh(w/wSharp);
end CoulombFriction;

model StribeckFriction "Coulomb friction with a breakaway part that fades with speed"
  parameter Real fC = 0 "Size at speed";
  parameter Real fExtra = 0 "Extra size near rest";
  parameter Real vS = 1 "Speed at which the extra part has fallen to 37 %";
  parameter Real wSharp = 0.01 "Speed at which 76 % of the full size is reached";
  input Real q "Position";
  input Real w "Speed";
  output Real f "= -(fC + fExtra exp(-(w/vS)^2)) tanh(w/wSharp)";
equation
  f = -(fC + fExtra*exp(-(w/vS)^2))*tanh(w/wSharp);
end StribeckFriction;

model QuadraticDrag "Force growing with the square of speed"
  parameter Real c = 0 "Drag";
  input Real q "Position";
  input Real w "Speed";
  output Real f "= -c |w| w";
equation
  f = -c*noEvent(abs(w))*w;
end QuadraticDrag;

model Spring "Spring about some position"
  parameter Real k = 0 "Stiffness";
  parameter Real f0 = 0 "Force at q = 0";
  input Real q "Position";
  input Real w "Speed";
  output Real f "= f0 - k q";
equation
  f = f0 - k*q;
end Spring;

model Hysteresis "Force that depends on the path (Bouc-Wen with exponent 1)"
  parameter Real H = 0 "Force of the fully developed loop";
  parameter Real xYield = 1 "Distance over which the force develops";
  parameter Real sigma = 0.7 "Shape of the loop: 0.5 unloads steeply, 1 as it loads";
  input Real q "Position";
  input Real w "Speed";
  output Real f "= -H z";
  Real z(start=0, fixed=true, min=-1, max=1) "Share of the loop's force";
equation
  der(z) = noEvent((w - abs(w)*z*sigma - w*abs(z)*(1 - sigma))/xYield);
  f = -H*z;
end Hysteresis;

model Cogging "Force that repeats with the position"
  parameter Real sine = 0 "Amplitude of the sine";
  parameter Real cosine = 0 "Amplitude of the cosine";
  parameter Real periods = 1 "Phase advance for each unit of position";
  input Real q "Position";
  input Real w "Speed";
  output Real f "= sine sin(periods q) + cosine cos(periods q)";
equation
  f = sine*sin(periods*q) + cosine*cos(periods*q);
end Cogging;

model EndStop "Soft stop above some position"
  parameter Real k = 0 "Stiffness of the stop";
  parameter Real qStop = 0 "Position at which the stop begins";
  input Real q "Position";
  input Real w "Speed";
  output Real f "= -k max(0, q - qStop)";
equation
  f = -k*noEvent(max(0, q - qStop));
end EndStop;

model Sum "Sum of two signals"
  input Real u1 "First";
  input Real u2 "Second";
  output Real y "= u1 + u2";
equation
  y = u1 + u2;
end Sum;

model Rate "Rate of change of a signal, through a lag"
  parameter Real T(unit="s", min=1e-6) = 0.001 "Time constant of the lag";
  parameter Real k(unit="1/s") = 1/T "Gain; for steps h of a master (1 - exp(-h/T))/h, which makes it the last difference";
  input Real u "Signal";
  output Real y "k (u - x), close to der(u) for what is slower than T";
  Real x(start=0, fixed=false) "The signal behind the lag";
initial equation
  x = u;
equation
  der(x) = (u - x)/T;
  y = k*(u - x);
end Rate;
