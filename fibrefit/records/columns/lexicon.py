"""Words by which what stands beside a table may tell that its numbers are to be changed, and those that settle it.

A star stands for any letters; accents are left out, and a word is in lower case.
"""

from __future__ import annotations

import re
from collections.abc import Sequence


def lexicon(*text: str) -> re.Pattern[str]:
    """Pattern of one of several words, with blanks between them, in which a star stands for any letters.

    Parameters
    ----------
    *text : str
        Words with blanks between them.
    """
    words = sorted({word for part in text for word in part.split()})
    return re.compile("|".join(word.replace("*", r"[^\W\d_]*") for word in words))


#: What of a quantity owns a number that is no reading of it, in the same claim as its name.
NOT_READ = lexicon(
    "rows count total top* bottom* anzahl length lange longueur longitud lunghezza celda column* spalte* fallweg"
    " federweg bremsweg *sensor snimac* czujnik* capteur* sensore* len crosshead traverse ai ch range* vorkraft"
    " pull* capacity rated sensor* cell* *zelle transducer* limit* overload preload pretension vorlast breaking"
    " impact noise resolution* accuracy rate speed step* stop* max* min* peak* fmax fmin mean avg valley"
    " mittelwert filter* bandwidth trigger* mass* hohe *hohe height channel* kanal* kan* interval* intervall*"
    " *intervall sampling sample* sampled duration dauer record* recording test* stamp* increment* inc division"
    " div axis zone step base start* end* messrate abtastrate datenrate bildrate scanrate framerate baudrate unit"
    " units einheit* acquisition points number bereich messbereich *bereich aufnehmer *aufnehmer nennwert kennwert"
    " sensitivity kraftaufnehmer wegaufnehmer class klasse *klasse frame* plate* id nr no serial model* type typ*"
    " laser* encoder* lvdt camera* logger* period* header*"
)
#: Words of a change that are at home in a head, where something else says what becomes of it.
TECHNICAL = lexicon(
    "scal* skalier* factor* faktor* calib* cal kalib* kalibr* gain* verstarkung ratio* slope* intercept offset* zero*"
    " null* tare* tara balance* baseline bias drift* shift* delay* lag* latency skew compensat* coefficient* coeff*"
    " koeff* correct* korrek* polarit* sign vorzeichen conver* umrechn* attenuat* dampf* damping decimat*"
    " averag* gemittelt raw unfiltered linear* autozero autoscale exponent shunt multiplier"
    " coefficient",
    # and what is said of them once they are done
    "subtract* removed applied already eliminated considered accounted deducted cancelled abgezogen angewendet"
    " angewandt berucksichtigt eingerechnet enthalten korrigiert kompensiert tared zeroed nulled genullt tariert"
    " bereits missing",
)
#: Of these, what tells by how much readings are off without load, and what they are to be multiplied by or turned.
OFFSETS = lexicon(
    "offset* zero* null* nullpunkt* nullwert* tare* tara* tarier* bias baseline versatz decalage* posun* nul[aoyu]*"
    " przesun* scostament* desfase desvio cero* azzer*"
)
MULTIPLIES = lexicon(
    "scal* skalier* factor* faktor* fact* gain* multipl* mult ratio* slope* sensitiv* empfindlich* verstark* invert*"
    " sign vorzeichen polarit* facteur* fattore* ganancia times divid* geteilt coeff* koeff* coefficient* delay* lag*"
    " range* *bereich"
)
#: Words of a change wherever they stand: what multiplies, moves or turns, and shares.
CHANGES = lexicon(
    "scal* rescal* factor* faktor* fact mult mul korr att pulses multipl* divid* divis* convert* calibrat*"
    " uncalib* gain* amplified amplification amplific* attenuat* lever* offset* zero* tare* untared bias* shift*"
    " drift* subtract* deduct* invert* inverted negat* negativ* revers* flip* mirror* opposite upside swap* swopp*"
    " exchang* interchang* confus* error* half* halv* doubl* twice tripl* percent* averag* decimat* thinn* skip*"
    " omit* delay* lag lags lagged lagging stretch* overestim* underestim* defect* unplugged disconnect*",
    "skalier* umrechn* umgerechn* verstarkt* verstarkung gedampft hebel* versatz nullpunkt* abzieh* abzuzieh*"
    " abgezog* addier* invertier* negativ* umgekehrt* umgedreht* verdreht* vertausch* verwechs* gespiegelt irrtum*"
    " irrtumlich* versehentlich halb halbe[nmrs]? halbiert* doppelt* verdoppel* dreifach* zehnfach* prozent*"
    " gemittelt ausgedunnt jede* verzoger* gedehnt geteilt kalibrier* unkalibriert tariert* genullt* korrigier*",
    "facteur* multipli* divis* converti* etalonn* calibr* inverse* invers* negatif* oppose* echang* erreur*"
    " moitie double* triple* pourcent moyenn* decime* decimat* decima decimas decimo* retard* ralenti tarer tare"
    " decalage corrig* soustrai* echelle",
    "factor* multiplic* dividi* dividir convers* calibr* ganancia invert* negativ* opuest* intercambi* equivoc*"
    " mitad doble* triple* porcentaje promedi* diezm* retras* tara desplaz* corrig* restar escala",
    "fattore* dimezz* raddopp* moltiplic* divid* converti* tarat* calibr* guadagno invert* negativ* oppost*"
    " scambi* sbagliat* errat* doppi* tripl* percento mediat* decimat* manca* ritard* azzer* corrett* sottra*"
    " scala",
    "nasob* vynasob* delen* delit* vydel* prevod* prepoct* kalibr* zesilen* obracen* opacn* zaporn* prehozen*"
    " zamenen* omyl* polovi* dvoj* dvakrat trikrat procent* prumer* vynech* ztrac* zpozd* tara tarov* posun*"
    " odecist odecten* nekalibr* desetin* setin* krat znamenk*",
    "mnoz* pomnoz* podziel* dziel* przelicz* kalibr* wzmocn* odwroc* odwrotn* ujemn* zamien* omylk* polow*"
    " podwoj* dwukrot* procent* sredn* opozn* spowoln* tara przesun* odjac",
    "minus moins menos meno doubled backwards upside tackle crossed gekreuzt croise* cruzad* incrociat*",
    "plus",
    # that something is amiss
    "wrong* mistak* erron* incorrect* should must instead not never yet too missing lost late slow* unreliable broken"
    " attention careful beware",
    "statt anstatt falsch* soll* muss* mussen fehl* verloren verspat* zu langsam* nicht kein* nie noch"
    " achtung vorsicht mal",
    "faux fausse doit devrait lieu manqu* perdu* pas non jamais encore debe* lugar falta* perdid* lento nunca aun"
    " atencion errore deve dovrebbe invece manca perso mai ancora attenzione",
    "misto musi chyb* spatn* pomal* neni nebyl* jeste pozor zamiast powin* musi* pomin* brak nie jeszcze uwaga zle"
    " bledn* blad*",
)
#: Of words of a change, what was done where a switch says yes.
SWITCHED = lexicon(
    "calib* kalib* balance* shunt temperature coefficient tare* tara* zero* null* compensat* autozero offset*"
    " correct* korrek* linear* autoscale gain*"
)
#: Of these, what a certificate tells of.
CERTIFIED = lexicon("calib* kalib* cal kal")
#: Of these, what a minus says is turned.
OF_SIDES = lexicon("polarit* sign vorzeichen")
#: What has a word of a change in it and is none.
PHRASES = re.compile(
    r"(?:\+/-|\u00b1)\s*[\d.,]+\s*[^\s;,]*|\b(?:n[or](?=\.? ?\d)|missing values?"
    r"|no ?data value|(?:per|pro) (?:second|sekunde)|scale divisions?|and +\d+ more"
    r"|(?:night|day|late|early|morning|evening)[- ]?shift|shift\W+(?:night|day|late|early|morning|evening|[1-3a-d])"
    r"|(?-i:[A-Z]+\d\w*) plus|twice (?:in|during|before|after|a)"
    r"|raw data|rohdaten|inverted pendulum|reading mode|every sample stored|all samples|some words"
    r"|real[- ]?time|no averag\w*|actual_range"
    r"|(?:laboratory|kitchen|digital) scale|gain set by factory|offset of the laser from the axis|not used"
    r"|[\w-]+\.(?:jpe?g|png|mp4|mov|avi|csv|txt|dat|py|m|vi|log|xlsx?)|[a-z]+_\d+|(?-i:[A-Z]{1,6}-\d{2,}[A-Z]*)"
    r"|temperature coefficient of \w+\W+[\d.]+ ?\S*|since (?:19|20)\d\d|type?\W+(?:double|single)\b"
    r"|averaging\W+(?=median)|median +\d+|0x[0-9a-f]+|\d+-(?!fold|times|fach|mal)[a-z]{4,}|\d{4}[A-MO-Z]{1,2}"
    r"|(?:vertical|horizontal) (?:position|scale|offset|delay)|(?:units?|values?) after scaling"
    r"|(?:double|three|two)[- ]?(?:click|core))\b",
    re.I,
)
#: What types of numbers are called, and words that stand beside these: none of them changes a number.
TYPES = frozenset(("double", "float", "long", "integer", "string", "boolean", "unsigned", "rfc"))
OF_TYPES = TYPES | {"format", "datatype", "type", "types", "int", "single", "date", "time"}
#: Words of how the rows came about, where what is said is not of one channel.
OF_TIMES = lexicon(
    "casov* ran speed tape replay replayed throughput turn divider divisor prescaler skip* decimat* thinn* every nth"
    " interval* rate* samples sampled sampling resampl* downsampl* subsampl* undersampl* abtast* messrate abtastrate"
    " datenrate bildrate scanrate framerate baudrate scan* frame* fps clock tick* timer time* zeit* playback slow*"
    " seconds minute* jede* kazdy kazda row* rows zeile* hz khz",
    "shorter baud crystal",
)
#: Words that beside what is measured tell that it is not as it should be, or is borne, moved or counted otherwise.
BESIDE = lexicon(
    # a contrast, a mistake, something to be done
    "forg* assum* actual* really true vs versus but although though despite rather only still need* pending old"
    " previous template dead loose",
    "nur anstelle eigentlich wirklich stimmt seul* reel* oubli* solo sola no real* olvid* cambi* reale dimentic*",
    "jen pouze nutno treba tylko nalezy trzeba",
    # a part of it
    "per each every split* parallel leg* strand* branch* limb* equal* half both pair",
    "pro je jede* zweite* strang strange*",
    "chaque brin* mouf* dixieme* demi* moitie veces fois volte krat razy",
    "cada ramal* mitad ogni ramo rami pramen* desetin* polovin* kazd* polow*",
    # another way of the load or of the motion
    "lever* tackle sheave* pulley* counterweight gear* drum turns looped reeve* paranco palan rolle* umlenk* hebel*"
    " flaschenzug gegengewicht",
    # a side
    "other negative compression rises rising falling grows growing backward* envers reves contrario rovescio ruckwarts"
    " arriere indietro atras pozpatku wstecz against gegen contre contra contro proti przeciw*",
    # a unit in words
    "*newton* kilogram* gram* grams pound* kilopond* libra* livre* kilo kilos",
    # how fast time goes
    "speed* fast* slow* compressed pace crystal replay* renumbered langsam* lento pomal*",
)
#: What is stated in per cent of a quantity and changes nothing.
INACCURACY = lexicon(
    "accuracy genauigkeit uncertainty tolerance* linearity nonlinearity hysteresis noise resolution* limit* class"
    " klasse precision repeatability creep aborted triggered"
)
RANGE = lexicon("range* *bereich plage rango campo rozsah zakres")
RATIO = re.compile(r"\d\s?:\d|\d : \d")
#: What is given by a number of parts and their size: "2 x 1.25 kg", "M8 x 20".
SIZED = lexicon(
    "zoom cord* lano lana corde corda cuerda lina fibre* sling* rope* seil* weight* gewicht* mass* masse* screw*"
    " schraube* bolt* specimen* plate* size* dimension*"
)
NEUTRAL = re.compile(
    r"(?<!\d)[:=;,\t ]\s*(?:no|none|off|false|nein|aus|0|0[.,]0+|1|1[.,]0+|ok|auto|n/a|disabled|default|normal"
    r"|positive|)\W*$|[:=;,\t]\s*-\s*$",
    re.I,
)
#: A key of which nothing is said.
NOTHING = re.compile(
    r"([^:=;,|\t]+)[:=;,|\t]\s*(?:no|none|nothing|n/a|keine?[rsn]?|aucune?|ningun[oa]?|nessun[oa]?|zadn[aey]|brak|-+)?\W*",
    re.I,
)
SWITCHED_ON = re.compile(r"[:=;,\t ]\s*(?:yes|on|true|ja|ein|done|ok|durchgef\w*|active|enabled)\W*$|\bby\b", re.I)
#: One of several, in words, and a side that is the other one.
_UP = r"(?:up(?:wards?)?|oben|aufw\u00e4rts|arriba|haut|nahoru|vzh\u016fru|l'alto|g\u00f3r[\u0119y])"
_DOWN = r"(?:down(?:wards?)?|unten|abajo|bas|dol[u\u016f])"
_POSITIVE = r"(?:positi[vf]\w*|plus|kladn\w*|dodatni\w*)"
ONE_OF = re.compile(
    rf"\b(?:{_UP} \w+ {_DOWN}|{_DOWN} \w+ {_UP})\b|"
    r"\b(?:one|each|either|eine[rnms]?|une?|uno|jeden|jedna|jedn\w+|jednoho)\b"
    r"(?: \w+)? (?:in|of|out of|von|de|des|di|dei|delle|ze?|entre|sur)"
    r" (?:(?:the|den|les|los|las) )?(?:two|three|four|zwei|drei|vier|deux|trois|dos|tres"
    r"|due|tre|dvou|dwoch|dwóch|several|\d+)\b",
    re.I,
)
#: A side that is counted, or stands for another.
SIDED = re.compile(
    rf"\b{_UP}\b.*\b{_POSITIVE}\b|\b{_POSITIVE}\b[^,;]*\b{_UP}\b"
    rf"|\b(?:counts?|reads?|registers?|grows?|increases?|z(?:\u00e4|ae)hlt|zeigt|cuenta|compte|conta)\b.*\b(?:{_UP}|{_DOWN}|backwards?)\b",
    re.I,
)
#: A number that runs with the motion, or against it.
_RUNS = (
    r"(?:(?:in|de)creas|shrink|gr[eo]w|rise|ris(?:es|ing)|fall|drop|sink|(?:ab|zu)nimm|nimm|kleiner|gr\u00f6\u00df|w\u00e4chs"
    r"|diminu|augment|baja|sube|cre[cs]|cala|aument|kles|roste|maleje|ro\u015bnie|larger|smaller|higher|lower|greater)\w*"
)
COVARIES = re.compile(
    rf"\b{_RUNS}\b.*\b(?:as|when|while|means?|wenn|w\u00e4hrend|sobald|bedeute\w*|quand|lorsque|signifi\w*|cuando|mientras"
    r"|quando|mentre|kdy\u017e|znamen\u00e1|gdy|oznacza)\b",
    re.I,
)
TO_BE = re.compile(r"\b(?:in units? of|to be|has to|have to|is to|are to)\b", re.I)
#: A name with its version.
VERSION = re.compile(r"\W*(?:[A-Z][\w-]*[a-z][\w-]*\s+){1,4}v?\d+(?:\.\d+)*\W*")
#: That something is otherwise than it should be, whatever it is.
CONTRAST = re.compile(
    r"\b(?:should|must|instead|in place of|wrong\w*|mistake\w*|actual\w*|really|assum\w*|vs|versus|statt|anstelle"
    r"|falsch\w*|au lieu|invece|al posto|en lugar|en vez|m[i\u00ed]sto|zamiast)\b",
    re.I,
)
#: What makes a number beside a calibration that of its certificate.
DATED = re.compile(r"\b(?:dates?|datum|due|valid|until|expires?|certificate\w*|cert|serial)\b", re.I)
UNIT_KEY = re.compile(
    r"\b(?:units?|einheit|unit[\u00e9e]|unidad|unit[\u00e0a]|jednotka)\b[^:=;,\t]*[:=;,\t]\s*(?:lbs?|kgf?|kilo\w*|pounds?|gram\w*|libras?|livres?)\b",
    re.I,
)
NO_UNITS = frozenset(("in", "ft", "um"))
SEPARATORS = r"[:=;|\t,]"
SLASH = re.compile(r" / (?=\d+(?:\.\d+)? ?[^\W\d]|\d+(?:\.\d+)? ?%)")
#: Forces that are given in units of mass.
IN_MASS = re.compile(
    r"^(?!.*(?:mass|weight|gewicht|peso|poids)).*\b(?:in|en|em|ve?|we?)\s+(?:lbs?|kgf?|kilo\w*|pounds?|libras?|livres?|gram\w*|pond\w*)\b",
    re.I,
)


def names_types(words: Sequence[str]) -> bool:
    """Whether words name types of numbers and nothing else: ``#datatype,string,double``."""
    return not TYPES.isdisjoint(words) and set(words) <= OF_TYPES
