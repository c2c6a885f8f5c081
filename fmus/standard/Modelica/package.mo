package Modelica "What small models use of the Modelica Standard Library, where that library itself is not given: units, constants and signals"
  package Units
    package SI
      type Angle = Real(final quantity="Angle", final unit="rad");
      type SolidAngle = Real(final quantity="SolidAngle", final unit="sr");
      type Length = Real(final quantity="Length", final unit="m");
      type Distance = Real(final quantity="Distance", final unit="m", min=0);
      type Breadth = Real(final quantity="Breadth", final unit="m", min=0);
      type Height = Real(final quantity="Height", final unit="m", min=0);
      type Thickness = Real(final quantity="Thickness", final unit="m", min=0);
      type Radius = Real(final quantity="Radius", final unit="m", min=0);
      type Diameter = Real(final quantity="Diameter", final unit="m", min=0);
      type PathLength = Real(final quantity="PathLength", final unit="m");
      type Position = Real(final quantity="Position", final unit="m");
      type Area = Real(final quantity="Area", final unit="m2");
      type Volume = Real(final quantity="Volume", final unit="m3");
      type Time = Real(final quantity="Time", final unit="s");
      type Duration = Real(final quantity="Duration", final unit="s");
      type Period = Real(final quantity="Period", final unit="s");
      type AngularVelocity = Real(final quantity="AngularVelocity", final unit="rad/s");
      type AngularAcceleration = Real(final quantity="AngularAcceleration", final unit="rad/s2");
      type AngularJerk = Real(final quantity="AngularJerk", final unit="rad/s3");
      type Velocity = Real(final quantity="Velocity", final unit="m/s");
      type Acceleration = Real(final quantity="Acceleration", final unit="m/s2");
      type Jerk = Real(final quantity="Jerk", final unit="m/s3");
      type Frequency = Real(final quantity="Frequency", final unit="Hz");
      type AngularFrequency = Real(final quantity="AngularFrequency", final unit="rad/s");
      type Wavelength = Real(final quantity="Wavelength", final unit="m");
      type WaveNumber = Real(final quantity="WaveNumber", final unit="m-1");
      type DampingCoefficient = Real(final quantity="DampingCoefficient", final unit="s-1");
      type Mass = Real(final quantity="Mass", final unit="kg", min=0);
      type Density = Real(final quantity="Density", final unit="kg/m3", min=0);
      type SpecificVolume = Real(final quantity="SpecificVolume", final unit="m3/kg", min=0);
      type LinearDensity = Real(final quantity="LinearDensity", final unit="kg/m", min=0);
      type SurfaceDensity = Real(final quantity="SurfaceDensity", final unit="kg/m2", min=0);
      type Momentum = Real(final quantity="Momentum", final unit="kg.m/s");
      type Impulse = Real(final quantity="Impulse", final unit="N.s");
      type AngularMomentum = Real(final quantity="AngularMomentum", final unit="kg.m2/s");
      type MomentOfInertia = Real(final quantity="MomentOfInertia", final unit="kg.m2");
      type Inertia = Real(final quantity="Inertia", final unit="kg.m2");
      type Force = Real(final quantity="Force", final unit="N");
      type TranslationalSpringConstant = Real(final quantity="TranslationalSpringConstant", final unit="N/m");
      type TranslationalDampingConstant = Real(final quantity="TranslationalDampingConstant", final unit="N.s/m");
      type Weight = Real(final quantity="Weight", final unit="N");
      type Torque = Real(final quantity="Torque", final unit="N.m");
      type MomentOfForce = Real(final quantity="MomentOfForce", final unit="N.m");
      type ElectricalTorqueConstant = Real(final quantity="ElectricalTorqueConstant", final unit="N.m/A");
      type ImpulseFlowRate = Real(final quantity="ImpulseFlowRate", final unit="N");
      type AngularImpulseFlowRate = Real(final quantity="AngularImpulseFlowRate", final unit="N.m");
      type RotationalSpringConstant = Real(final quantity="RotationalSpringConstant", final unit="N.m/rad");
      type RotationalDampingConstant = Real(final quantity="RotationalDampingConstant", final unit="N.m.s/rad");
      type Pressure = Real(final quantity="Pressure", final unit="Pa");
      type AbsolutePressure = Real(final quantity="AbsolutePressure", final unit="Pa", min=0, nominal=1e5, displayUnit="bar");
      type PressureDifference = Real(final quantity="PressureDifference", final unit="Pa");
      type BulkModulus = Real(final quantity="BulkModulus", final unit="Pa");
      type Stress = Real(final quantity="Stress", final unit="Pa");
      type NormalStress = Real(final quantity="NormalStress", final unit="Pa");
      type ShearStress = Real(final quantity="ShearStress", final unit="Pa");
      type Strain = Real(final quantity="Strain", final unit="1");
      type LinearStrain = Real(final quantity="LinearStrain", final unit="1");
      type ModulusOfElasticity = Real(final quantity="ModulusOfElasticity", final unit="Pa");
      type ShearModulus = Real(final quantity="ShearModulus", final unit="Pa");
      type SecondMomentOfArea = Real(final quantity="SecondMomentOfArea", final unit="m4");
      type SectionModulus = Real(final quantity="SectionModulus", final unit="m3");
      type CoefficientOfFriction = Real(final quantity="CoefficientOfFriction", final unit="1");
      type DynamicViscosity = Real(final quantity="DynamicViscosity", final unit="Pa.s", min=0);
      type KinematicViscosity = Real(final quantity="KinematicViscosity", final unit="m2/s", min=0);
      type SurfaceTension = Real(final quantity="SurfaceTension", final unit="N/m");
      type Work = Real(final quantity="Work", final unit="J");
      type Energy = Real(final quantity="Energy", final unit="J");
      type EnergyDensity = Real(final quantity="EnergyDensity", final unit="J/m3");
      type PotentialEnergy = Real(final quantity="PotentialEnergy", final unit="J");
      type KineticEnergy = Real(final quantity="KineticEnergy", final unit="J");
      type Power = Real(final quantity="Power", final unit="W");
      type EnergyFlowRate = Real(final quantity="EnergyFlowRate", final unit="W");
      type EnthalpyFlowRate = Real(final quantity="EnthalpyFlowRate", final unit="W");
      type Efficiency = Real(final quantity="Efficiency", final unit="1", min=0);
      type MassFlowRate = Real(final quantity="MassFlowRate", final unit="kg/s");
      type VolumeFlowRate = Real(final quantity="VolumeFlowRate", final unit="m3/s");
      type MomentumFlux = Real(final quantity="MomentumFlux", final unit="N");
      type ThermodynamicTemperature = Real(final quantity="ThermodynamicTemperature", final unit="K", min=0, start=288.15, nominal=300, displayUnit="degC");
      type Temperature = Real(final quantity="Temperature", final unit="K", min=0, start=288.15, nominal=300, displayUnit="degC");
      type TemperatureDifference = Real(final quantity="TemperatureDifference", final unit="K");
      type TemperatureSlope = Real(final quantity="TemperatureSlope", final unit="K/s");
      type LinearExpansionCoefficient = Real(final quantity="LinearExpansionCoefficient", final unit="1/K");
      type CubicExpansionCoefficient = Real(final quantity="CubicExpansionCoefficient", final unit="1/K");
      type Compressibility = Real(final quantity="Compressibility", final unit="1/Pa");
      type IsothermalCompressibility = Real(final quantity="IsothermalCompressibility", final unit="1/Pa");
      type IsentropicCompressibility = Real(final quantity="IsentropicCompressibility", final unit="1/Pa");
      type Heat = Real(final quantity="Heat", final unit="J");
      type HeatFlowRate = Real(final quantity="HeatFlowRate", final unit="W");
      type HeatFlux = Real(final quantity="HeatFlux", final unit="W/m2");
      type DensityOfHeatFlowRate = Real(final quantity="DensityOfHeatFlowRate", final unit="W/m2");
      type ThermalConductivity = Real(final quantity="ThermalConductivity", final unit="W/(m.K)");
      type CoefficientOfHeatTransfer = Real(final quantity="CoefficientOfHeatTransfer", final unit="W/(m2.K)");
      type SurfaceCoefficientOfHeatTransfer = Real(final quantity="SurfaceCoefficientOfHeatTransfer", final unit="W/(m2.K)");
      type ThermalInsulance = Real(final quantity="ThermalInsulance", final unit="m2.K/W");
      type ThermalResistance = Real(final quantity="ThermalResistance", final unit="K/W");
      type ThermalConductance = Real(final quantity="ThermalConductance", final unit="W/K");
      type ThermalDiffusivity = Real(final quantity="ThermalDiffusivity", final unit="m2/s");
      type HeatCapacity = Real(final quantity="HeatCapacity", final unit="J/K");
      type SpecificHeatCapacity = Real(final quantity="SpecificHeatCapacity", final unit="J/(kg.K)");
      type SpecificHeatCapacityAtConstantPressure = Real(final quantity="SpecificHeatCapacityAtConstantPressure", final unit="J/(kg.K)");
      type SpecificHeatCapacityAtConstantVolume = Real(final quantity="SpecificHeatCapacityAtConstantVolume", final unit="J/(kg.K)");
      type RatioOfSpecificHeatCapacities = Real(final quantity="RatioOfSpecificHeatCapacities", final unit="1");
      type IsentropicExponent = Real(final quantity="IsentropicExponent", final unit="1");
      type Entropy = Real(final quantity="Entropy", final unit="J/K");
      type EntropyFlowRate = Real(final quantity="EntropyFlowRate", final unit="W/K");
      type SpecificEntropy = Real(final quantity="SpecificEntropy", final unit="J/(kg.K)");
      type InternalEnergy = Real(final quantity="InternalEnergy", final unit="J");
      type Enthalpy = Real(final quantity="Enthalpy", final unit="J");
      type SpecificEnergy = Real(final quantity="SpecificEnergy", final unit="J/kg");
      type SpecificInternalEnergy = Real(final quantity="SpecificInternalEnergy", final unit="J/kg");
      type SpecificEnthalpy = Real(final quantity="SpecificEnthalpy", final unit="J/kg");
      type DerDensityByPressure = Real(final quantity="DerDensityByPressure", final unit="s2/m2");
      type DerDensityByTemperature = Real(final quantity="DerDensityByTemperature", final unit="kg/(m3.K)");
      type ElectricCurrent = Real(final quantity="ElectricCurrent", final unit="A");
      type Current = Real(final quantity="Current", final unit="A");
      type CurrentSlope = Real(final quantity="CurrentSlope", final unit="A/s");
      type ElectricCharge = Real(final quantity="ElectricCharge", final unit="C");
      type Charge = Real(final quantity="Charge", final unit="C");
      type VolumeDensityOfCharge = Real(final quantity="VolumeDensityOfCharge", final unit="C/m3");
      type ElectricFieldStrength = Real(final quantity="ElectricFieldStrength", final unit="V/m");
      type ElectricPotential = Real(final quantity="ElectricPotential", final unit="V");
      type Voltage = Real(final quantity="Voltage", final unit="V");
      type PotentialDifference = Real(final quantity="PotentialDifference", final unit="V");
      type ElectromotiveForce = Real(final quantity="ElectromotiveForce", final unit="V");
      type VoltageSecond = Real(final quantity="VoltageSecond", final unit="V.s");
      type VoltageSlope = Real(final quantity="VoltageSlope", final unit="V/s");
      type ElectricFluxDensity = Real(final quantity="ElectricFluxDensity", final unit="C/m2");
      type ElectricFlux = Real(final quantity="ElectricFlux", final unit="C");
      type Capacitance = Real(final quantity="Capacitance", final unit="F", min=0);
      type Permittivity = Real(final quantity="Permittivity", final unit="F/m");
      type CurrentDensity = Real(final quantity="CurrentDensity", final unit="A/m2");
      type MagneticFieldStrength = Real(final quantity="MagneticFieldStrength", final unit="A/m");
      type MagneticPotential = Real(final quantity="MagneticPotential", final unit="A");
      type MagneticPotentialDifference = Real(final quantity="MagneticPotentialDifference", final unit="A");
      type MagnetomotiveForce = Real(final quantity="MagnetomotiveForce", final unit="A");
      type MagneticFluxDensity = Real(final quantity="MagneticFluxDensity", final unit="T");
      type MagneticFlux = Real(final quantity="MagneticFlux", final unit="Wb");
      type MagneticVectorPotential = Real(final quantity="MagneticVectorPotential", final unit="Wb/m");
      type Inductance = Real(final quantity="Inductance", final unit="H");
      type SelfInductance = Real(final quantity="SelfInductance", final unit="H", min=0);
      type MutualInductance = Real(final quantity="MutualInductance", final unit="H");
      type CouplingCoefficient = Real(final quantity="CouplingCoefficient", final unit="1");
      type Permeability = Real(final quantity="Permeability", final unit="H/m");
      type RelativePermeability = Real(final quantity="RelativePermeability", final unit="1");
      type RelativePermittivity = Real(final quantity="RelativePermittivity", final unit="1");
      type Reluctance = Real(final quantity="Reluctance", final unit="H-1");
      type Permeance = Real(final quantity="Permeance", final unit="H");
      type Resistance = Real(final quantity="Resistance", final unit="Ohm");
      type Resistivity = Real(final quantity="Resistivity", final unit="Ohm.m");
      type Conductance = Real(final quantity="Conductance", final unit="S");
      type Conductivity = Real(final quantity="Conductivity", final unit="S/m");
      type Impedance = Real(final quantity="Impedance", final unit="Ohm");
      type Reactance = Real(final quantity="Reactance", final unit="Ohm");
      type Admittance = Real(final quantity="Admittance", final unit="S");
      type Susceptance = Real(final quantity="Susceptance", final unit="S");
      type ActivePower = Real(final quantity="ActivePower", final unit="W");
      type ApparentPower = Real(final quantity="ApparentPower", final unit="V.A");
      type ReactivePower = Real(final quantity="ReactivePower", final unit="var");
      type PowerFactor = Real(final quantity="PowerFactor", final unit="1");
      type InstantaneousPower = Real(final quantity="InstantaneousPower", final unit="W");
      type LinearTemperatureCoefficient = Real(final quantity="LinearTemperatureCoefficient", final unit="1/K");
      type LinearTemperatureCoefficientResistance = Real(final quantity="LinearTemperatureCoefficientResistance", final unit="Ohm/K");
      type RadiantEnergy = Real(final quantity="RadiantEnergy", final unit="J");
      type RadiantPower = Real(final quantity="RadiantPower", final unit="W");
      type Irradiance = Real(final quantity="Irradiance", final unit="W/m2");
      type Emissivity = Real(final quantity="Emissivity", final unit="1");
      type LuminousIntensity = Real(final quantity="LuminousIntensity", final unit="cd");
      type LuminousFlux = Real(final quantity="LuminousFlux", final unit="lm");
      type Illuminance = Real(final quantity="Illuminance", final unit="lx");
      type Luminance = Real(final quantity="Luminance", final unit="cd/m2");
      type RadiantExitance = Real(final quantity="RadiantExitance", final unit="W/m2");
      type SoundPressure = Real(final quantity="SoundPressure", final unit="Pa");
      type Damping = Real(final quantity="Damping", final unit="s-1");
      type LogarithmicDecrement = Real(final quantity="LogarithmicDecrement", final unit="1");
      type PressureSlope = Real(final quantity="PressureSlope", final unit="Pa/s");
      type PoissonNumber = Real(final quantity="PoissonNumber", final unit="1");
      type ElectricalForceConstant = Real(final quantity="ElectricalForceConstant", final unit="N/A");
      type Transconductance = Real(final quantity="Transconductance", final unit="A/V");
      type SeebeckCoefficient = Real(final quantity="SeebeckCoefficient", final unit="V/K");
      type VolumeFraction = Real(final quantity="VolumeFraction", final unit="1");
      type Molarity = Real(final quantity="Molarity", final unit="mol/m3");
      type ChemicalPotential = Real(final quantity="ChemicalPotential", final unit="J/mol");
      type FaradayConstant = Real(final quantity="FaradayConstant", final unit="C/mol");
      type GibbsFreeEnergy = Real(final quantity="GibbsFreeEnergy", final unit="J");
      type HelmholtzFreeEnergy = Real(final quantity="HelmholtzFreeEnergy", final unit="J");
      type PhaseDifference = Real(final quantity="PhaseDifference", final unit="rad");
      type ResistancePerUnitLength = Real(final quantity="ResistancePerUnitLength", final unit="Ohm/m");
      type AmountOfSubstance = Real(final quantity="AmountOfSubstance", final unit="mol", min=0);
      type MolarMass = Real(final quantity="MolarMass", final unit="kg/mol", min=0);
      type MolarVolume = Real(final quantity="MolarVolume", final unit="m3/mol");
      type MolarInternalEnergy = Real(final quantity="MolarInternalEnergy", final unit="J/mol");
      type MolarEnergy = Real(final quantity="MolarEnergy", final unit="J/mol");
      type MolarHeatCapacity = Real(final quantity="MolarHeatCapacity", final unit="J/(mol.K)");
      type MolarEntropy = Real(final quantity="MolarEntropy", final unit="J/(mol.K)");
      type MolarEnthalpy = Real(final quantity="MolarEnthalpy", final unit="J/mol");
      type MolarFlowRate = Real(final quantity="MolarFlowRate", final unit="mol/s");
      type MolarDensity = Real(final quantity="MolarDensity", final unit="mol/m3");
      type Concentration = Real(final quantity="Concentration", final unit="mol/m3");
      type Molality = Real(final quantity="Molality", final unit="mol/kg");
      type MoleFraction = Real(final quantity="MoleFraction", final unit="1", min=0, max=1);
      type MassFraction = Real(final quantity="MassFraction", final unit="1", min=0, max=1);
      type MassConcentration = Real(final quantity="MassConcentration", final unit="kg/m3");
      type PartialPressure = Real(final quantity="PartialPressure", final unit="Pa", min=0);
      type DiffusionCoefficient = Real(final quantity="DiffusionCoefficient", final unit="m2/s");
      type StoichiometricNumber = Real(final quantity="StoichiometricNumber", final unit="1");
      type Activity = Real(final quantity="Activity", final unit="Bq");
      type HalfLife = Real(final quantity="HalfLife", final unit="s");
      type ReynoldsNumber = Real(final quantity="ReynoldsNumber", final unit="1");
      type NusseltNumber = Real(final quantity="NusseltNumber", final unit="1");
      type PrandtlNumber = Real(final quantity="PrandtlNumber", final unit="1");
      type MachNumber = Real(final quantity="MachNumber", final unit="1");
      type FroudeNumber = Real(final quantity="FroudeNumber", final unit="1");
      type BiotNumber = Real(final quantity="BiotNumber", final unit="1");
      type GrashofNumber = Real(final quantity="GrashofNumber", final unit="1");
      type RayleighNumber = Real(final quantity="RayleighNumber", final unit="1");
      type RelativeDensity = Real(final quantity="RelativeDensity", final unit="1");
      type QualityFactor = Real(final quantity="QualityFactor", final unit="1");
      type LossAngle = Real(final quantity="LossAngle", final unit="rad");
      type DimensionlessRatio = Real(final quantity="DimensionlessRatio", final unit="1");
      type PerUnit = Real(final quantity="PerUnit", final unit="1");
    end SI;
    package NonSI
      type Temperature_degC = Real(final quantity="Temperature_degC", final unit="degC");
      type Temperature_degF = Real(final quantity="Temperature_degF", final unit="degF");
      type Angle_deg = Real(final quantity="Angle_deg", final unit="deg");
      type AngularVelocity_rpm = Real(final quantity="AngularVelocity_rpm", final unit="rev/min");
      type Velocity_kmh = Real(final quantity="Velocity_kmh", final unit="km/h");
      type Time_day = Real(final quantity="Time_day", final unit="d");
      type Time_hour = Real(final quantity="Time_hour", final unit="h");
      type Time_minute = Real(final quantity="Time_minute", final unit="min");
      type Volume_litre = Real(final quantity="Volume_litre", final unit="l");
      type ElectricCharge_Ah = Real(final quantity="ElectricCharge_Ah", final unit="A.h");
      type Energy_Wh = Real(final quantity="Energy_Wh", final unit="W.h");
      type Energy_kWh = Real(final quantity="Energy_kWh", final unit="kW.h");
      type Pressure_bar = Real(final quantity="Pressure_bar", final unit="bar");
      type MassFlowRate_gps = Real(final quantity="MassFlowRate_gps", final unit="g/s");
    end NonSI;
    package Conversions
      function from_degC "From degC to K"
        input Modelica.Units.NonSI.Temperature_degC u;
        output Modelica.Units.SI.Temperature y;
      algorithm
        y := u + 273.15;
      end from_degC;
      function to_degC "From K to degC"
        input Modelica.Units.SI.Temperature u;
        output Modelica.Units.NonSI.Temperature_degC y;
      algorithm
        y := u - 273.15;
      end to_degC;
      function from_deg "From deg to rad"
        input Modelica.Units.NonSI.Angle_deg u;
        output Modelica.Units.SI.Angle y;
      algorithm
        y := (Modelica.Constants.pi/180)*u;
      end from_deg;
      function to_deg "From rad to deg"
        input Modelica.Units.SI.Angle u;
        output Modelica.Units.NonSI.Angle_deg y;
      algorithm
        y := (180/Modelica.Constants.pi)*u;
      end to_deg;
      function from_rpm "From rev/min to rad/s"
        input Modelica.Units.NonSI.AngularVelocity_rpm u;
        output Modelica.Units.SI.AngularVelocity y;
      algorithm
        y := (Modelica.Constants.pi/30)*u;
      end from_rpm;
      function to_rpm "From rad/s to rev/min"
        input Modelica.Units.SI.AngularVelocity u;
        output Modelica.Units.NonSI.AngularVelocity_rpm y;
      algorithm
        y := (30/Modelica.Constants.pi)*u;
      end to_rpm;
      function from_kmh "From km/h to m/s"
        input Modelica.Units.NonSI.Velocity_kmh u;
        output Modelica.Units.SI.Velocity y;
      algorithm
        y := u/3.6;
      end from_kmh;
      function to_kmh "From m/s to km/h"
        input Modelica.Units.SI.Velocity u;
        output Modelica.Units.NonSI.Velocity_kmh y;
      algorithm
        y := 3.6*u;
      end to_kmh;
      function from_bar "From bar to Pa"
        input Modelica.Units.NonSI.Pressure_bar u;
        output Modelica.Units.SI.Pressure y;
      algorithm
        y := 1e5*u;
      end from_bar;
      function to_bar "From Pa to bar"
        input Modelica.Units.SI.Pressure u;
        output Modelica.Units.NonSI.Pressure_bar y;
      algorithm
        y := 1e-5*u;
      end to_bar;
      function from_hour "From h to s"
        input Modelica.Units.NonSI.Time_hour u;
        output Modelica.Units.SI.Time y;
      algorithm
        y := 3600*u;
      end from_hour;
      function to_hour "From s to h"
        input Modelica.Units.SI.Time u;
        output Modelica.Units.NonSI.Time_hour y;
      algorithm
        y := u/3600;
      end to_hour;
      function from_minute "From min to s"
        input Modelica.Units.NonSI.Time_minute u;
        output Modelica.Units.SI.Time y;
      algorithm
        y := 60*u;
      end from_minute;
      function to_minute "From s to min"
        input Modelica.Units.SI.Time u;
        output Modelica.Units.NonSI.Time_minute y;
      algorithm
        y := u/60;
      end to_minute;
      function from_litre "From l to m3"
        input Modelica.Units.NonSI.Volume_litre u;
        output Modelica.Units.SI.Volume y;
      algorithm
        y := 1e-3*u;
      end from_litre;
      function to_litre "From m3 to l"
        input Modelica.Units.SI.Volume u;
        output Modelica.Units.NonSI.Volume_litre y;
      algorithm
        y := 1e3*u;
      end to_litre;
      function from_Ah "From A.h to C"
        input Modelica.Units.NonSI.ElectricCharge_Ah u;
        output Modelica.Units.SI.ElectricCharge y;
      algorithm
        y := 3600*u;
      end from_Ah;
      function to_Ah "From C to A.h"
        input Modelica.Units.SI.ElectricCharge u;
        output Modelica.Units.NonSI.ElectricCharge_Ah y;
      algorithm
        y := u/3600;
      end to_Ah;
      function from_kWh "From kW.h to J"
        input Modelica.Units.NonSI.Energy_kWh u;
        output Modelica.Units.SI.Energy y;
      algorithm
        y := 3.6e6*u;
      end from_kWh;
      function to_kWh "From J to kW.h"
        input Modelica.Units.SI.Energy u;
        output Modelica.Units.NonSI.Energy_kWh y;
      algorithm
        y := u/3.6e6;
      end to_kWh;
    end Conversions;
  end Units;
  package Constants
    constant Real pi = 3.14159265358979323846;
    constant Real e = 2.71828182845904523536;
    constant Real D2R(unit="rad/deg") = pi/180;
    constant Real R2D(unit="deg/rad") = 180/pi;
    constant Real small = 1e-60;
    constant Real eps = 2.220446049250313e-16;
    constant Real inf = 1.7976931348623157e308;
    constant Modelica.Units.SI.Velocity c = 299792458;
    constant Modelica.Units.SI.Acceleration g_n = 9.80665;
    constant Real G(unit="m3/(kg.s2)") = 6.67430e-11;
    constant Real h(unit="J.s") = 6.62607015e-34;
    constant Modelica.Units.SI.ElectricCharge q = 1.602176634e-19;
    constant Real k(unit="J/K") = 1.380649e-23;
    constant Real N_A(unit="1/mol") = 6.02214076e23;
    constant Real R(unit="J/(mol.K)") = 8.31446261815324;
    constant Real F(unit="C/mol") = 96485.33212331002;
    constant Real sigma(unit="W/(m2.K4)") = 5.670374419e-8;
    constant Real mu_0(unit="N/A2") = 1.25663706212e-6;
    constant Real epsilon_0(unit="F/m") = 8.8541878128e-12;
    constant Modelica.Units.SI.Temperature T_zero = -273.15;
  end Constants;
  package Blocks
    package Interfaces
      connector RealInput = input Real;
      connector RealOutput = output Real;
    end Interfaces;
  end Blocks;
end Modelica;
