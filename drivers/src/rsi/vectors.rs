//! The telegrams that reference/PROTOCOLS.md, section 1, quotes, for the tests. Where the quotation leaves values or elements out
//! (dots there), they are filled in here with values of the same form; what is quoted stands as quoted.

/// Name, bytes, stamp as text.
pub(super) const TELEGRAMS: [(&str, &str, &str); 13] = [
    ("KRC4, no white space", KRC4, "435413237"),
    ("KRC2, Dat form with a rail", KRC2_DAT, "680309708"),
    ("KRC2, flat and short", KRC2_SHORT, "4211158252"),
    ("KRC2, flat and rich", KRC2_FLAT, "4211158252"),
    ("FZI's rich form", RICH, "0000000123"),
    ("TYPE, as simulators spell it", UPPER, "100"),
    ("digits at the start of an attribute name", GPIO, "1"),
    ("other white space, BOOL and LONG with decimals", SPACED, "0000000000"),
    ("the manual's reply", SEN_MANUAL, "123645634563"),
    ("a ROS driver's reply", SEN_ROS, "123456"),
    ("K-SDK's reply", SEN_KROSHU, "0"),
    ("KRC2's reply in the Dat form", SEN_DAT, "0000000000"),
    ("KRC2's first frame with a stamp", HELLO, "680309704"),
];

pub(super) const KRC4: &str = concat!(
    r#"<Rob Type="KUKA"><RIst X="0.00000" Y="1.50000" Z="-2.25000" A="0.00000" B="90.00000" C="-180.00000"/>"#,
    r#"<AIPos A1="0.00000" A2="-90.00000" A3="90.00000" A4="0.00000" A5="0.00000" A6="0.00000"/>"#,
    r#"<EIPos E1="0.00000" E2="0.00000" E3="0.00000" E4="0.00000" E5="0.00000" E6="0.00000"/>"#,
    r#"<Delay D="15"/><IPOC>435413237</IPOC></Rob>"#,
);

pub(super) const KRC2_DAT: &str = concat!(
    "<Rob Type=\"KUKA\">\n\t<Dat TaskType=\"b\">\n\t\t<ComStatus>continuous</ComStatus>\n\t\t",
    r#"<RIst X="93.9531" Y="-347.9674" Z="1844.9703" A="-126.9460" B="24.9226" C="-28.2871"/>"#,
    "\n\t\t",
    r#"<RSol X="93.9530" Y="-347.9670" Z="1844.9700" A="-126.9460" B="24.9226" C="-28.2871"/>"#,
    "\n\t\t",
    r#"<AIPos A1="74.8478" A2="-61.2000" A3="120.5000" A4="0.0000" A5="30.7000" A6="-12.0001"/>"#,
    r#"<ASPos A1="74.8478" A2="-61.2000" A3="120.5000" A4="0.0000" A5="30.7000" A6="-12.0000"/>"#,
    "\n\t\t",
    r#"<EIPos E1="226966.9326" E2="0.0000" E3="0.0000" E4="0.0000" E5="0.0000" E6="0.0000"/>"#,
    r#"<ESPos E1="226966.9375" E2="0.0000" E3="0.0000" E4="0.0000" E5="0.0000" E6="0.0000"/>"#,
    "\n\t\t",
    r#"<MACur A1="0.1143" A2="-4.2000" A3="2.1000" A4="0.0000" A5="0.1000" A6="0.0000"/>"#,
    r#"<MECur E1="-0.0005" E2="0.0000" E3="0.0000" E4="0.0000" E5="0.0000" E6="0.0000"/>"#,
    "\n\t\t<IPOC>680309708</IPOC>\n\t\t<BMode>3</BMode><IPOStat>65</IPOStat>\n\t\t",
    r#"<Tech x="1" p6="0.0000" p7="0.0000" p6x1="0.0000" p7x1="0.0000" p8x3="0.0000"/>"#,
    "\n\t\t",
    r#"<RGH X="0" Y="0" Z="0" A="0" B="0" C="0" S="00000" T="00000"/>"#,
    "<DiI>0</DiI>\n\t\t<Tick>0000000000000000</Tick><RWMode>C</RWMode>\n\t</Dat>\n</Rob>\n",
);

pub(super) const KRC2_SHORT: &str = concat!(
    "<Rob Type=\"KUKA\">\n",
    r#"<RIst X="1458.8766" Y="0.0000" Z="1899.1234" A="180.0000" B="0.0000" C="180.0000"/>"#,
    "\n<IPOC>4211158252</IPOC>\n</Rob>\n",
);

pub(super) const KRC2_FLAT: &str = concat!(
    "<Rob Type=\"KUKA\">\r\n",
    r#"<RIst X="1458.8766" Y="0.0000" Z="1899.1234" A="180.0000" B="0.0000" C="180.0000" />"#,
    r#"<RSol X="1458.8766" Y="0.0000" Z="1899.1234" A="180.0000" B="0.0000" C="180.0000" />"#,
    r#"<AIPos A1="0.0000" A2="-90.0000" A3="90.0000" A4="0.0000" A5="0.0000" A6="0.0000" />"#,
    r#"<ASPos A1="0.0000" A2="-90.0000" A3="90.0000" A4="0.0000" A5="0.0000" A6="0.0000" />"#,
    r#"<EIPos E1="0.0000" E2="0.0000" E3="0.0000" E4="0.0000" E5="0.0000" E6="0.0000" />"#,
    r#"<ESPos E1="0.0000" E2="0.0000" E3="0.0000" E4="0.0000" E5="0.0000" E6="0.0000" />"#,
    r#"<MACur A1="0.0000" A2="0.0000" A3="0.0000" A4="0.0000" A5="0.0000" A6="0.0000" />"#,
    "\r\n<Delay D=\"0\" />",
    r#"<Tech C11="0.0000" C12="0.0000" C13="0.0000" C14="0.0000" C15="0.0000" C16="0.0000" C17="0.0000" "#,
    r#"C18="0.0000" C19="0.0000" C110="0.0000" /><DiL>0</DiL><Digout o1="0" o2="1" o3="0" /><ST_Source>17.232</ST_Source>"#,
    r#"<FTC Fx="1.2340" Fy="2.5000" Fz="-75.4000" Tx="0.0100" Ty="0.0200" Tz="-0.0300" State="00000000" />"#,
    "\r\n<IPOC>4211158252</IPOC>\r\n</Rob>",
);

pub(super) const RICH: &str = concat!(
    r#"<Rob Type="KUKA"><RIst X="1.0" Y="2.0" Z="3.0" A="4.0" B="5.0" C="6.0"/>"#,
    r#"<RSol X="1.0" Y="2.0" Z="3.0" A="4.0" B="5.0" C="6.0"/>"#,
    r#"<AIPos A1="0.0" A2="-90.0" A3="90.0" A4="0.0" A5="90.0" A6="0.0"/>"#,
    r#"<ASPos A1="0.0" A2="-90.0" A3="90.0" A4="0.0" A5="90.0" A6="0.0"/><Delay D="0"/>"#,
    r#"<GearTorque A1="1.0" A2="-2.0" A3="3.0" A4="0.0" A5="0.0" A6="0.0"/><ProgStatus R="3"/><OvPro R="99"/>"#,
    r#"<IPOC>0000000123</IPOC></Rob>"#,
);

pub(super) const UPPER: &str =
    r#"<Rob TYPE="KUKA"><RIst X="0.0" Y="0.0" Z="0.0" A="0.0" B="0.0" C="0.0"/><Delay D="0"/><IPOC>100</IPOC></Rob>"#;

pub(super) const GPIO: &str = r#"<Rob Type="KUKA"><Delay D="0"/><GPIO 01="1" 02="0"/><IPOC>1</IPOC></Rob>"#;

pub(super) const SPACED: &str =
    "<Rob Type=\"KUKA\">\t<Delay D=\"0.000000\"\t/>\r\n<Run>1.00</Run>\n\n<IPOC>0000000000</IPOC> </Rob>\r\n";

pub(super) const SEN_MANUAL: &str = concat!(
    r#"<Sen Type="ImFree"><EStr>text</EStr><RKorr X="0.0000" Y="0.0000" Z="0.0000" A="0.0000" B="0.0000" C="0.0000"/>"#,
    r#"<AKorr A1="0.0000" A2="0.0000" A3="0.0000" A4="0.0000" A5="0.0000" A6="0.0000"/>"#,
    r#"<EKorr E1="0.0000" E2="0.0000" E3="0.0000" E4="0.0000" E5="0.0000" E6="0.0000"/>"#,
    r#"<Tech T21="1.09" T22="2.08" T23="3.07" T24="4.06" T25="5.05" T26="6.04" T27="7.03" T28="8.02" T29="9.01" "#,
    r#"T210="10.00"/><DiO>125</DiO><IPOC>123645634563</IPOC></Sen>"#,
);

pub(super) const SEN_ROS: &str = concat!(
    r#"<Sen Type="ImFree"><AK A1="0.000000" A2="1.000000" A3="2.000000" A4="3.000000" A5="4.000000" A6="5.000000" />"#,
    r#"<IPOC>123456</IPOC></Sen>"#,
);

pub(super) const SEN_KROSHU: &str = concat!(
    r#"<Sen Type="KROSHU"><Stop>0</Stop><AK A1="-1.000000" A2="0.000000" A3="0.000000" A4="0.000000" A5="0.000000" "#,
    r#"A6="0.000000"/><EK E1="0.000000"/><GPIO 01="1"/><IPOC>0</IPOC></Sen>"#,
);

pub(super) const SEN_DAT: &str = concat!(
    r#"<Sen Type="CoRob" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" "#,
    r#"xsi:noNamespaceSchemaLocation="ExternalData.xsd"><Dat TaskType="b">"#,
    r#"<RKorr X="0.0000" Y="0.0000" Z="0.0000" A="0.0000" B="0.0000" C="0.0000"/><IPOC>0000000000</IPOC></Dat></Sen>"#,
);

pub(super) const HELLO: &str = "<Rob Type=\"KUKA\">\n<IPOC>680309704</IPOC>\n</Rob>\n";

/// KRC2's first frame, with a stamp that is empty.
pub(super) const HELLO_EMPTY: &str = r#"<Rob Type="KUKA"><IPOC/></Rob>"#;

/// The correction over a flat link: the configuration that most tests speak by.
pub(super) const CONFIG: &str = r#"<ROOT>
  <CONFIG>
    <IP_NUMBER>192.168.1.2</IP_NUMBER>   <!-- of the PC !-->
    <PORT>49152</PORT>
    <SENTYPE>ImFree</SENTYPE>
    <ONLYSEND>FALSE</ONLYSEND>
  </CONFIG>
  <SEND><ELEMENTS>
    <ELEMENT TAG="DEF_RIst" TYPE="DOUBLE" INDX="INTERNAL" />
    <ELEMENT TAG="DEF_EIPos" TYPE="DOUBLE" INDX="INTERNAL" />
    <ELEMENT TAG="DEF_Delay" TYPE="LONG" INDX="INTERNAL" />
  </ELEMENTS></SEND>
  <RECEIVE><ELEMENTS>
    <ELEMENT TAG="DEF_EStr" TYPE="STRING" INDX="INTERNAL" />
    <ELEMENT TAG="Stop" TYPE="BOOL" INDX="1" HOLDON="0" />
    <ELEMENT TAG="RKorr.X" TYPE="DOUBLE" INDX="2" HOLDON="1" />
    <ELEMENT TAG="RKorr.Y" TYPE="DOUBLE" INDX="3" HOLDON="1" />
    <ELEMENT TAG="RKorr.Z" TYPE="DOUBLE" INDX="4" HOLDON="1" />
    <ELEMENT TAG="RKorr.A" TYPE="DOUBLE" INDX="5" HOLDON="1" />
    <ELEMENT TAG="RKorr.B" TYPE="DOUBLE" INDX="6" HOLDON="1" />
    <ELEMENT TAG="RKorr.C" TYPE="DOUBLE" INDX="7" HOLDON="1" />
    <ELEMENT TAG="DiO" TYPE="LONG" INDX="8" HOLDON="1" />
  </ELEMENTS></RECEIVE>
</ROOT>
"#;

/// A frame of [`CONFIG`].
pub(super) fn frame(ipoc: u64, x_mm: f64, late: i64) -> Vec<u8> {
    format!(
        concat!(
            r#"<Rob Type="KUKA"><RIst X="{:.4}" Y="0.0000" Z="0.0000" A="0.0000" B="0.0000" C="0.0000"/>"#,
            r#"<EIPos E1="226966.9326" E2="0.0000" E3="0.0000" E4="0.0000" E5="0.0000" E6="0.0000"/>"#,
            r#"<Delay D="{}"/><IPOC>{:010}</IPOC></Rob>"#,
        ),
        x_mm, late, ipoc
    )
    .into_bytes()
}
