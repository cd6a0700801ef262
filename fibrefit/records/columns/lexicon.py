"""Words that what stands beside a table is made of, where they are known to leave its numbers as they are; and others.

A word that is not here is not known. A star stands for any letters; accents are left out, and a word is in lower case.
"""

from __future__ import annotations

import re


def lexicon(*text: str) -> re.Pattern[str]:
    """Pattern of one of several words, with blanks between them, in which a star stands for any letters.

    Parameters
    ----------
    *text : str
        Words with blanks between them.
    """
    words = sorted({word for part in text for word in part.split()})
    return re.compile("|".join(word.replace("*", r"[^\W\d_]*") for word in words))


#: Words that join others, by language.
GLUE = (
    "yes no on off none true false positive positiv ja nein aus ein more a an the of in at to from by with and or for"
    " as is are was were be been has have had it its this that these those there here then after before during while"
    " when until since between under above below over behind beside near into via which who whose where all any every"
    " some new old",
    "der die das den dem des ein eine einer eines einem einen und oder mit von vom zu zum zur im am an auf bei nach"
    " vor aus fur durch uber unter ist sind war waren wurde wurden wird werden hat haben als wie es sich je pro",
    "le la les l d de du des un une et ou avec par pour dans sur sous est sont au aux en ce cette s y el los las del"
    " con por para es son al il lo i gli di della dei e o su da alla dal",
    "v ve na z ze se do od pri po je jsou byl byla bylo w we przy dla jest sa",
)
#: What owns a number, or is set: people, dates, places, parts, settings; and what is done without changing numbers.
OWNERS = (
    # people, dates, papers, files
    "operator* lab date* datum day* monday am pm zone saved export printed written recorded acquired logged stored"
    " started stopped generated measured name* file* folder path test* *test* versuch* run* no nr n number id serial"
    " sn certificate* kalibrierschein standard* version firmware software model* type typ* class klasse line* row*"
    " columns record* messung* dataset set block* section* trigger* pretrigger posttrigger pre status mode* cycle*"
    " step* ok ready done start* end* stop* first last next second third room drop* fall* impact* impactor* release*"
    " released hit* creep preload* pretension* vorkraft vorspann* warm* setting info* results comment* value* wert*"
    " data",
    # chain of measurement
    "sensor* sensors transducer* aufnehmer *aufnehmer capteur sensore cell* *zelle loadcell* laser* encoder* lvdt"
    " potentiometer camera* kamera daq* logger* datalogger recorder* scope* oscilloscope instrument* gerat* device*"
    " module* modul amplifier* amp verstarker *verstarker preamp* bridge brucke excitation supply speisung batter*"
    " voltage spannung power mains channel* kanal* kanale canal* chan ch voie ai ao di input* output* eingang*"
    " ausgang* port pin slot cable kabel connector usb ethernet com baud bus ip address adc bit bits resolution*"
    " auflosung accuracy genauigkeit precision linearity hysteresis uncertainty noise rauschen rms rated capacity"
    " cap nennlast nennkraft nennwert range* bereich* messbereich *bereich measuring span limit* grenz* overload"
    " protection safe breaking strength alarm sensitivity kennwert empfindlichkeit bandwidth bandbreite filter*"
    " gefiltert *filter tiefpass* lowpass highpass bandpass notch low high pass cut cutoff corner bessel butterworth"
    " chebyshev anti aliasing antialias* fir iir median smoothing oversampling bandstop grenzfrequenz carrier"
    " frequency frequenz frekvence frequence* frecuencia freq fs rate messrate abtastrate datenrate bildrate"
    " scanrate framerate baudrate sample* sampled sampling abtast* vzorkovac* echantillonnage muestreo acquisition"
    " acquire* erfassung scan* interval* intervall* *intervall period* periode dt delta increment* inc xinc tinc"
    " timebase zeitbasis zeitschritt schrittweite samplerate sampletime sps ksps fps frame* bild* hz khz duration"
    " dauer *dauer length* lange* *lange laenge points punkte anzahl size buffer memory speicher depth total values"
    " waveform* trace* curve* signal* plot* diagram graph chart axis achse x y z horizontal vertical unit units"
    " einheit* unite* unidad* jednotk* format decimal* separator delimiter encoding checksum crc hash terminal rse"
    " differential diff single ended coupling dc ac impedance probe* div display refresh update screen monitor"
    " language locale region",
    # specimen, rig, surroundings
    "*probe batch rope* seil* cord* webbing knot* screw* clamp* rig* machine crosshead table bearing guide* rail"
    " mass* masse* weight* pendulum height* diameter* thickness width gauge slack taut speed* velocity stroke energy"
    " temperature* temperatur* teplota humidity pressure ambient dried trocken conditioned upper lower top bottom"
    " oben unten left right links rechts front rear middle ends inner outer colour polyester static dynamic"
    " halbstatisch strands kg kistler hbm shimadzu python numpy arduino teensy catmanfile",
    # what instruments print
    "excel header footer label* legend fc g h trace* index xstart xstop tot capture subject usec max* min minimum speed"
    " rel plate* setup frame* head chain end* link* point* celda zoom std relative ts sr e kp ki kd d l annotation* log"
    " timed column count atf sequence samples vision vom point trig determined zmk trace lsb j controller* meta"
    " history down downwards up order milliseconds microseconds seconds minutes hours len due unused included used"
    " gps fmin fmax mean avg peak* valley tup missing nodata xorg stamp daylight saving see model root quality"
    " degrees auto analog analogue digital long infinii scopy bio ware wf hresolution timeaxis ruckfuhrung aborted"
    " carga linear principle method humid* mounted montiert befestigt installed placed hanging vertically"
    " horizontally attached fixed fastened tied full measurement* measur* c ambient* frequence filtre filtro czujnik"
    " snimac cella electromagnet device view temp strain ohm loop video photo* rssi disabled bungee attempt stopper"
    " hits clamp elapsed since bm internal complete messkanal kraftaufnehmer wegaufnehmer wa pandas *sensor rows"
    " gestartet gemessen logging campionamento none list fallweg genauigkeitsklasse mittelwert maximalwert"
    " minimalwert standardabweichung rest nano",
)
#: What of a quantity owns a number that is no reading of it, in the same claim as its name.
NOT_READ = (
    "celda column* spalte* fallweg federweg bremsweg *sensor snimac* czujnik* capteur* sensore* len crosshead"
    " traverse ai ch range* vorkraft pull* capacity rated sensor* cell* *zelle transducer* limit* overload preload"
    " pretension vorlast breaking impact noise resolution* accuracy rate speed step* stop* max* min* peak* fmax fmin"
    " mean avg valley mittelwert filter* bandwidth trigger* mass* hohe *hohe height channel* kanal* kan* interval*"
    " intervall* *intervall sampling sample* sampled duration dauer record* recording test* stamp* increment* inc"
    " division div axis zone step base start* end* messrate abtastrate datenrate bildrate scanrate framerate baudrate"
    " unit units einheit* acquisition points number bereich messbereich *bereich aufnehmer *aufnehmer nennwert"
    " kennwert sensitivity kraftaufnehmer wegaufnehmer class klasse frame* plate* id nr no serial model* type typ*"
    " laser* encoder* lvdt camera* logger* period* header*"
)
#: Words of a change that are at home in a head, where something else says what becomes of it.
TECHNICAL = lexicon(
    "scal* skalier* factor* faktor* calib* cal kalib* kalibr* gain* verstarkung ratio* slope* intercept offset* zero*"
    " null* tare* tara balance* baseline bias drift* shift* delay* lag* latency skew compensat* coefficient* coeff*"
    " koeff* correct* korrek* polarit* sign vorzeichen invert* conver* umrechn* attenuat* dampf* damping decimat*"
    " averag* gemittelt raw unfiltered linear* autozero autoscale exponent clock timer tick* shunt multiplier"
    " coefficient",
    # and what is said of them once they are done
    "subtract* removed applied already eliminated considered accounted deducted cancelled abgezogen angewendet"
    " angewandt berucksichtigt eingerechnet enthalten korrigiert kompensiert tared zeroed nulled genullt tariert"
    " bereits missing",
)
#: Words of a change wherever they stand, with nothing else known in a sentence.
CHANGES = lexicon(
    "scal* rescal* factor* faktor* fact mult mul korr att pulses"
    " multipl* divid* divis* convert* calibrat* uncalib* gain* amplif* attenuat* lever*"
    " offset* zero* tare* untared bias* shift* drift* subtract* deduct* invert* inverted negat* negativ* revers* flip*"
    " mirror* opposite upside swap* swopp* exchang* interchang* confus* wrong* mistak* erron* incorrect* error* should"
    " must instead half* halv* doubl* twice tripl* percent* averag* decimat* thinn* skip* omit* missing lost delay*"
    " lag lags lagged lagging late slow* stretch* overestim* underestim* too unreliable broken defect* unplugged"
    " disconnect* not never yet beware careful attention",
    "skalier* umrechn* umgerechn* verstark* gedampft hebel* versatz nullpunkt* abzieh* abzuzieh* abgezog* addier*"
    " invertier* negativ* umgekehrt* umgedreht* verdreht* vertausch* verwechs* gespiegelt falsch* irrtum* irrtumlich*"
    " versehentlich statt anstatt soll* muss* mussen halb* doppelt* verdoppel* dreifach* zehnfach* prozent* gemittelt"
    " ausgedunnt jede* fehl* verloren verzoger* verspat* zu langsam* gedehnt nicht kein* nie noch achtung vorsicht mal"
    " geteilt kalibrier* unkalibriert tariert* genullt* korrigier*",
    "facteur* multipli* divis* converti* etalonn* calibr* inverse* invers* negatif* oppose* echang* faux fausse"
    " erreur* doit devrait lieu moitie double* triple* pourcent moyenn* decim* manqu* perdu* retard* ralenti pas non"
    " jamais encore tarer tare decalage corrig* soustrai* attention echelle",
    "factor* multiplic* dividi* dividir convers* calibr* ganancia invert* negativ* opuest* intercambi* equivoc*"
    " erron* debe* lugar mitad doble* triple* porcentaje promedi* diezm* falta* perdid* retras* lento nunca aun tara"
    " desplaz* corrig* restar atencion escala",
    "fattore* moltiplic* divid* converti* tarat* calibr* guadagno invert* negativ* oppost* scambi* sbagliat* errat*"
    " errore deve dovrebbe invece doppi* tripl* percento mediat* decimat* manca* perso ritard* lento non mai ancora"
    " azzer* corrett* sottra* attenzione scala",
    "nasob* vynasob* delen* delit* vydel* prevod* prepoct* kalibr* zesilen* obracen* opacn* zaporn* prehozen*"
    " zamenen* spatn* chyb* omyl* misto musi polovi* dvoj* dvakrat trikrat procent* prumer* vynech* chybi ztrac*"
    " zpozd* pomal* neni nebyl* jeste pozor tara tarov* posun* odecist odecten* nekalibr* desetin* setin* krat"
    " znamenk*",
    "mnoz* pomnoz* podziel* dziel* przelicz* kalibr* wzmocn* odwroc* odwrotn* ujemn* zamien* zle bledn* blad* omylk*"
    " zamiast powin* musi* polow* podwoj* dwukrot* procent* sredn* pomin* brak opozn* spowoln* nie jeszcze uwaga tara"
    " przesun* odjac",
    "minus moins menos meno doubled backwards upside tackle",
    "plus",
)
#: Of these, what heads a column of a list of channels.
LABELS = lexicon(
    "factor* faktor* gain* offset* zero* slope* intercept scale scaling invert* calibration unit* raw null"
)
#: Of these, what was done where a switch says yes.
SWITCHED = lexicon(
    "calib* kalib* balance* shunt temperature coefficient tare* tara* zero* null* compensat* autozero offset*"
    " correct* korrek* linear* autoscale gain*"
)
#: Of these, what a certificate tells of.
CERTIFIED = lexicon("calib* kalib* cal kal")
#: What has a word of a change in it and is none.
PHRASES = re.compile(
    r"(?:\+/-|\u00b1)|\b(?:missing values?|no ?data value|(?:per|pro) (?:second|sekunde)|scale divisions?|and +\d+ more"
    r"|raw data|rohdaten|reading mode|every sample stored|all samples|some words|real[- ]?time|no averag\w*"
    r"|(?:laboratory|kitchen|digital) scale|gain set by factory|offset of the laser from the axis|not used"
    r"|[\w-]+\.(?:jpe?g|png|mp4|mov|avi|csv|txt|dat|py|m|vi|log|xlsx?)|[a-z]+_\d+|(?-i:[A-Z]{1,6}-\d{2,}[A-Z]*)"
    r"|temperature coefficient of \w+\W+[\d.]+ ?\S*|since (?:19|20)\d\d|type?\W+(?:double|single)\b"
    r"|averaging\W+(?=median)|median +\d+|0x[0-9a-f]+|\d+-(?!fold|times|fach|mal)[a-z]{4,}|\d{4}[A-MO-Z]{1,2}"
    r"|(?:vertical|horizontal) (?:position|scale|offset|delay)|(?:units?|values?) after scaling"
    r"|(?:double|three|two)[- ]?(?:click|core))\b",
    re.I,
)
#: Words of how the rows came about, where what is said is not of one channel.
OF_TIMES = lexicon(
    "casov* ran speed tape replay replayed throughput turn divider divisor prescaler skip* decimat* thinn* every nth"
    " interval* rate* samples sampled sampling resampl* downsampl* subsampl* undersampl* abtast* messrate abtastrate"
    " datenrate bildrate scanrate framerate baudrate scan* frame* fps clock tick* timer time* zeit* playback slow*"
    " seconds minute* jede* kazdy kazda row* rows zeile* hz khz",
    "shorter baud crystal",
)
#: Words of a claim that tells how often rows were taken, and nothing else.
OF_THE_RATE = lexicon(
    "sample* sampling rate frequency freq interval period scan scanning acquisition logging logger log data daq"
    " recording record measuring measurement samplerate abtastrate abtastfrequenz abtastintervall abtastzeit abtastung"
    " messrate messintervall messfrequenz fs dt ts delta t campionamento frequence frequenza frecuencia muestreo"
    " echantillonnage vzorkovaci vzorkovani speed time step of at was the is with frames"
)
