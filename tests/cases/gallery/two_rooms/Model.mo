package House "A flat of two rooms"
  connector HeatPort
    Real T(unit="K") "Temperature";
    flow Real Q(unit="W") "Heat flow into the component";
  end HeatPort;

  model Room "Air and furniture"
    parameter Real C(unit="J/K") "Heat capacity";
    parameter Real T0(unit="K") = 291.15;
    HeatPort port;
    Real T(unit="K", start=T0, fixed=true);
  equation
    C*der(T) = port.Q;
    port.T = T;
  end Room;

  model Wall
    parameter Real G(unit="W/K");
    HeatPort a, b;
  equation
    a.Q = G*(a.T - b.T);
    a.Q + b.Q = 0;
  end Wall;

  model Outdoors
    input Real T(unit="K");
    HeatPort port;
  equation
    port.T = T;
  end Outdoors;

  model Heater
    input Real P(unit="W");
    HeatPort port;
  equation
    port.Q = -P;
  end Heater;

  model Plant "Living room with a heater, bedroom without"
    Room living(C=2.6e6), bedroom(C=1.9e6);
    Wall between(G=55), facade1(G=38), facade2(G=24);
    input Real P(unit="W") "Heater";
    input Real Ta(unit="K", start=278.15) "Outside";
    output Real T1(unit="K") = living.T;
    output Real T2(unit="K") = bedroom.T;
    Outdoors outdoors(T=Ta);
    Heater heater(P=P);
  equation
    connect(living.port, between.a);
    connect(between.b, bedroom.port);
    connect(living.port, facade1.a);
    connect(bedroom.port, facade2.a);
    connect(facade1.b, outdoors.port);
    connect(facade2.b, outdoors.port);
    connect(heater.port, living.port);
  end Plant;
end House;
