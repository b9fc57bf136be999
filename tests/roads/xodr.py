"""Small OpenDRIVE files, written by hand."""

CLOTHOID_TOWN = """<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="4"/>
  <road id="1" length="100" junction="-1">
    <link><successor elementType="road" elementId="2" contactPoint="start"/></link>
    <type s="0" type="town"><speed max="50" unit="km/h"/></type>
    <planView>
      <geometry s="0" x="1000" y="2000" hdg="0" length="100"><line/></geometry>
    </planView>
    <elevationProfile><elevation s="0" a="5" b="0.01" c="0" d="0"/></elevationProfile>
    {lanes}
  </road>
  <road id="2" length="40" junction="-1">
    <link><predecessor elementType="road" elementId="1" contactPoint="end"/>
      <successor elementType="junction" elementId="9"/></link>
    <planView>
      <geometry s="0" x="1100" y="2000" hdg="0" length="40">
        <spiral curvStart="0" curvEnd="0.02"/></geometry>
    </planView>
    <elevationProfile><elevation s="0" a="6" b="0" c="0" d="0"/></elevationProfile>
    {lanes}
  </road>
  <road id="3" length="20" junction="9">
    <link><predecessor elementType="road" elementId="2" contactPoint="end"/></link>
    <planView>
      <geometry s="0" x="{x:.9f}" y="{y:.9f}" hdg="0.4" length="20">
        <arc curvature="0.02"/></geometry>
    </planView>
    <elevationProfile><elevation s="0" a="6" b="0" c="0" d="0"/></elevationProfile>
    {lanes}
  </road>
  <junction id="9" name="">
    <connection id="0" incomingRoad="2" connectingRoad="3" contactPoint="start">
      <laneLink from="-1" to="-1"/>
    </connection>
  </junction>
</OpenDRIVE>
"""

LANES = """<lanes>
  <laneSection s="0">
    <left><lane id="2" type="sidewalk"><link><predecessor id="2"/><successor id="2"/></link>
        <width sOffset="0" a="2" b="0" c="0" d="0"/></lane>
      <lane id="1" type="driving"><link><predecessor id="1"/><successor id="1"/></link>
        <width sOffset="0" a="3.25" b="0" c="0" d="0"/></lane></left>
    <center><lane id="0" type="none">
      <roadMark sOffset="0" type="broken" width="0.12"/></lane></center>
    <right><lane id="-1" type="driving"><link><predecessor id="-1"/><successor id="-1"/></link>
        <width sOffset="0" a="3.25" b="0" c="0" d="0"/>
        <roadMark sOffset="0" type="solid" width="0.12"/></lane></right>
  </laneSection>
</lanes>"""


def town() -> str:
    """A straight road, a clothoid after it, and an arc through a junction."""
    from math import cos, sin

    from scipy.integrate import quad

    x = 1100.0 + quad(lambda s: cos(0.00025 * s * s), 0.0, 40.0)[0]
    y = 2000.0 + quad(lambda s: sin(0.00025 * s * s), 0.0, 40.0)[0]
    return CLOTHOID_TOWN.format(lanes=LANES, x=x, y=y)
