"""Words by which a line beside a table may bear on its numbers, and those by which it is about something else."""

from __future__ import annotations

import re


def words(text: str) -> re.Pattern[str]:
    """Pattern of whole words, in any case.

    Parameters
    ----------
    text : str
        Words with ``|`` between them; a star stands for any letters, an underscore ends a word as a blank does.
    """
    own = text.replace("*", r"[^\W_]*")
    return re.compile(rf"(?<![^\W_])(?:{own})(?![^\W_])", re.I)


#: What numbers are multiplied by.
MULTIPLIED = words(
    "scal(?:e|es|ed|ing)|factor*|faktor*|multipl*|divi(?:de|ded|sor|der)|skalier*|umrechn*|conver(?:sion|t*)|ratio"
    "|korrektur*|correct(?:ion|ed)?|calib*|cal|kalibr*|slope*|steigung|coeff*|koeff*|gain*|verst(?:\u00e4|ae)rkung"
    "|attenuat*|d(?:\u00e4|ae)mpfung|\u00fcbersetzung|lever*|hebel*|gear|transmission|reev*|reeving|advantage"
    "|magnif*|amplification|vergr*|prefactor|[abck][01]|exponent|m[\u011be][\u0159r][i\u00ed]tko"
    "|zes[i\u00ed]len[i\u00ed]|facteur|fattore|ganancia|reduction"
)
#: What they are before something is done to them.
BEFORE = re.compile(
    r"\b(?:un(?:calibrated|scaled|corrected|converted)"
    r"|not (?:yet )?(?:calibrated|scaled|corrected|converted|linearised|linearized)"
    r"|(?:before|without|prior to) (?:calibration|scaling|correction|conversion|applying)"
    r"|(?:adc|raw|in|as) (?:counts|digits|codes)|normali[sz]ed|a\.\s?u\.|arbitrary units"
    r"|(?:percent|%) (?:of )?(?:range|full|fs\b|fso\b)|(?:nicht|un)\s?(?:kalibriert|skaliert)|half[- ]bridge equivalent"
    r"|per (?:rope|strand|cell|side|leg|cable|fibre|wire|bolt|hook|wheel|arm)|each of (?:two|2))|\(inv\)",
    re.I,
)
#: The same, as what a switch says.
NOT_YET = re.compile(
    r"(?<![^\W_])(?:(?:calibrated|scaled|converted|corrected|lineari[sz]ed|kalibriert|skaliert|applied)\W{1,4}0"
    r"|(?:calibrat|scal|conver|correct|linear|kalibrier|skalier)\w*(?:[ _](?:applied|done|active|on))?"
    r"\W{1,4}(?:no|false|off|nein|n))\s*$",
    re.I,
)
#: What stretches time.
SLOWED = words(
    "slow[- ]?motion|slow[- ]?mo|time ?lapse|playback|zeitlupe|zeitraffer|time ?stretch*|tape speed|clock|timer|tick*"
    "|frame*"
)
#: Of one number so much: "in 0.1 N".
IN_STEPS = re.compile(
    r"\b(?:in|units?(?: (?:of|is|are|set|to|in))*|einheit(?:en)?|per digit|per step"
    r"|increments? of|steps? of|schritt\w*)\s*[:=]?\s*"
    r"(\d+(?:[.,/]\d+)?(?:[eE][+-]?\d+)?)\s?([^\W\d_][^\s,;)\]]*)",
    re.I,
)
#: A line by which numbers are to be turned into others.
FORMULA = re.compile(
    r"(?<![^\W\d])([^\W\d]\w*)\s*=\s*[-+]?\d[\d.,]*(?:[eE][+-]?\d+)?\s*(?:[*\u00b7\u00d7]\s*([^\W\d]\w*)|(x)(?![^\W_]))"
    r"|(?<![^\W_])(m)\s*=\s*[\d.]+\W+(b)\s*=",
)
#: What is another quantity turned round.
NEGATED = re.compile(r"(?<![^\W\d])([^\W\d]\w*)\s*=\s*-\s*[^\W\d]")
#: That it was done.
DONE = re.compile(
    r"\b(?:applied|subtracted|removed|compensated|included|already|in engineering units|corrected for|considered"
    r"|eliminated|abgezogen|angewendet|angewandt|ber[u\u00fc]cksichtigt|eingerechnet|enthalten|korrigiert|tared|zeroed"
    r"|nulled|genullt|tariert|corrected|kompensiert"
    r"|bereits|calibrated|kalibriert|[e\u00e9]talonn[e\u00e9]e?s?|calibrad[oa]s?|tarat[oae]"
    r"|kalibrov[a\u00e1]n\w*|s?kalibrowan\w*|zero(?: of \w+)? set|set to zero)\b",
    re.I,
)
UNDONE = re.compile(
    r"\b(?:not|never|no|nicht|kein\w*|pas|non|nie|nen\u00ed|sin|sans|senza|bez|without|ohne|to be"
    r"|must|should|needs?|still|un(?:applied|corrected)|isn.t"
    r"|wasn.t)\b",
    re.I,
)
#: Whose factors, zeros and signs are not those of the numbers: parts of the chain before them, pictures, papers.
OF_OTHERS = words(
    "amplifier*|amp|preamp*|*verst(?:\u00e4|ae)rker|bridge|br(?:\u00fc|ue)cke|adc|pga|hx711|ads1\\d*|dac|sensor"
    "|transducer|gauge factor|k.?factor"
    "|k.?faktor|excitation|supply|probe*|display|anzeige|axis|plot|graph|chart|diagram|div|grid|colou?r|line"
    "|drawing|zeichnung"
    "|trigger*|horizontal|vertical|h|v|hor|vert|time ?zone|utc|gmt|byte*|bits?|header|index|file*|page|sheet|font"
    "|zoom|camera|exposure"
    "|temperature*|temp|humidity|pressure|safety|quality|shape|form|crest|duty|power|damping|load factor|fall factor"
    "|poisson*"
    "|young*|modulus"
    "|drift rate|certificate*|cert|number|nummer|no|nr|due|valid|until|expires?|next|last|laborator(?:y|ies)"
    "|interval|year|class"
    "|standard|iso|din|astm|en|id|kit|report|protocol|date|datum|day|crosshead|rig|ramp|incline*|track"
    "|stiffness|spring|filter*|cut ?off"
    "|pass|sampl*|downsampl*|subsampl*|undersampl*|oversampl*|resampl*|decimat*|abtast*|rate|clock|pendul*"
    "|pid|kp|ki|kd|controller|loop|regler|noise|tolerance|limit*|threshold|warn*|alarm|level|pixel*|px|image"
    "|microphone|mic"
)
STATISTIC = {
    "max": words("max*|massim*|m\u00e1x*|peak|f_?max|h(?:\u00f6|oe)chst*|largest|highest"),
    "min": words("min|minim*|m\u00ednim*|valley|smallest|lowest"),
    "mean": words("mean|average|avg|media|moyenne|promedio|mittelwert|mittel"),
}
NO_STATISTIC = words(
    "limit*|range|rated|capacity|nominal|allow*|permi*|sensor|cell|speed|rate*|warn*|alarm|set*|end|stop*|travel"
    "|scale|axis"
)
LASTING = words(
    "duration|total time|elapsed time|recording time|record time|test time|messdauer|dauer|aufnahmedauer|doba"
    "|lasted|length of record*"
)
#: Quantities no column of a record is of.
OTHER_QUANTITY = words(
    "temperature|temp|strain|dehnung|dms|pressure|druck|accel*|beschleunigung|voltage|spannung|current|strom"
    "|torque|moment|humidity|speed|power"
)
#: Powers of ten, and what pounds, kiloponds, inches and degrees are worth: factors by which a unit is mistaken.
MISTAKEN = (*(10.0**k for k in (-6, -4, -3, -2, -1, 1, 2, 3, 4, 6)), 9.80665, 4.4482216, 25.4, 2.54, 57.29578)
#: Factors between a clock and a mistaken one: decimations and averages, seconds for minutes or milliseconds.
MISTAKEN_TIMES = (2.0, 4.0, 5.0, 8.0, 10.0, 16.0, 20.0, 50.0, 60.0, 100.0, 1000.0)
#: Of a weight that was hung up to see what is shown.
CHECKED = words(
    "software|stamped|left (?:on|at)|set as|set to|entered|configur*|assum*|typed|programmed"
    "|gave|says|file|table|made|indicat*|reads|reading|shows?|shown|display*|actual*|true|instead|correspond*|equals?|anzeige|zeigt"
    "|tats(?:\u00e4|ae)chlich*|eingetragen|eingestellt|gesetzt|laut|inscrit*|saisi*|introducid*|impostat*|inserit*"
    "|zadan*|nastaven*|wpisan*|ustawion*"
)
#: What rows are made of, where they are counted by a rate that the head names.
OF_ROWS = words("scans?|samples?|rows?|points?|readings?|values?|zeilen?|werte?|messwerte?|abtastwerte?")
#: A load that is stated to be below zero where it pulls.
AGAINST = re.compile(
    r"\b(?:tension|tensile|pull(?:ing)?|traction|zug\w*|up(?:wards?)?)\s*(?:is|=|:|as|are|forces?|\(?-\)?|)\s*(?:negative|neg\b|minus|-(?=\W*$))"
    r"|\+\s*(?:=|is|:)\s*(?:push|compress|druck|down)|-\s*(?:=|is|:)\s*(?:pull|tens|zug)"
    r"|\bpush(?:ing)? (?:is )?(?:positive|plus)"
    r"|\b(?:compression|compressive|druck\w*|down(?:wards?)?)\s*(?:is|=|:|as|are|forces?|)\s*(?:positive|pos\b|plus|\+(?=\W*$))",
    re.I,
)
#: A position that is stated to grow upwards.
UPWARDS = re.compile(
    r"\bup(?:wards?)?\s*(?:is|=|:)?\s*(?:positive|plus|\+)|(?:\+|\bpositive|\bplus)\s*(?:is|=|:)?\s*up", re.I
)
#: What makes a number beside a calibration that of the calibration.
CONSTANT = words("factor*|faktor*|constant*|konstante|coeff*|koeff*|slope|value|wert|gain")
#: Units no number of ours is in.
FOREIGN_FORCES = frozenset(
    ("kp", "kilopond", "kiloponds", "pond", "ponds", "dyn", "dyne", "dynes", "poundal", "poundals", "tf", "tonf", "ozf")
)
#: Of how numbers are kept.
TYPE = words("format|type*|datentyp|datatype|precision|float*|real*|single")
#: Halves of something else.
HALVES = re.compile(
    r"\b(?:half|quarter|full|double|three|two)[- ](?:bridge|inch|sine|wave|duplex|sided|shear|braid\w*(?: rope)?|wire"
    r"|point|phase)\w*",
    re.I,
)
#: What the words for a sensor say of the quantity it is for.
OF_SENSORS = {
    "length": words("laser*|encoder*|lvdt|potentiometer|pot|wegaufnehmer|drum|wheel"),
    "force": words(
        "bridge|br(?:\u00fc|ue)cke|cell|load ?cell|gauge|kraftaufnehmer|kraftmess*|amplifier|verst(?:\u00e4|ae)rker"
    ),
}
#: What explains that rows are fewer than were sampled.
THINNED = words("decimat*|thinn*|divider|skip*|every|averag*|downsampl*|resampl*|reduc*")
#: That the last row was measured first.
NEWEST = words(
    "newest|latest|most recent|neueste*|j\u00fcngste*|absteigend*|descending|desc|last (?:sample|row|reading)s? first"
    "|plus r\u00e9cent*|m\u00e1s reciente*|pi\u00f9 recent*|nejnov\u011bj*|najnow*|reversed? (?:order|in time)"
)
