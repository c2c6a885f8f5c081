within FESArm.Effects;
package Shaft "Play of a shaft"
  annotation (Documentation(info="<html><p>What an elastic shaft feels of the twist between its two ends.</p></html>"));
end Shaft;
