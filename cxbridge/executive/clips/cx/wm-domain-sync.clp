; Keeps the world model (wm-fact) and the domain model (domain-fact,
; domain-object) the same, in both directions.
;
; A domain-fact of a declared predicate corresponds to a wm-fact with the key
; `domain fact NAME args? PARAM VALUE ...`, or to one below another path where a
; wm-sync-remap-fact says so. The domain-objects of a type correspond to a
; wm-fact with the key `domain objects-by-type TYPE`, a list.
;
; How a change is noticed. For each pair the state at the last synchronisation
; is kept, and the side that differs from it has changed and wins. Both the fact
; indexes (in wm-sync-map-fact) and the value of the wm-fact (in wm-sync-pair)
; are kept: a modify may give the fact a new index or may leave the index alone,
; according to who did it; either is a change.
;
; How it stays fast. Nothing compares one fact with all others. CLIPS looks up
; joins over single fields in hash tables, but not those over multifields or
; over function calls; hence each domain-fact gets a wm-sync-atom, which has the
; parameter values as one text, and all rules join over that text, the name and
; the ID.
;
; Order: names are noted at WM-IDKEY, deletions made at WM-SYNC-DEL, additions
; at WM-SYNC-ADD.
;
; Needs saliences.clp, domain.clp, worldmodel.clp.

; *** What is known of facts ***

(deftemplate wm-sync-map-fact
  "A wm-fact and a domain-fact that are kept the same, and the state of both."
  ; --- world model side: index 0 means that there is no fact
  (slot wm-fact-id (type STRING))
  (multislot wm-fact-key (type SYMBOL))
  (slot wm-fact-idx (type INTEGER))
  ; --- when the domain-fact goes: retract the wm-fact, or set its value FALSE?
  (slot wm-fact-retract (type SYMBOL)
                        (allowed-values TRUE FALSE)
                        (default TRUE))
  ; --- domain side: index 0 means that there is no fact
  (slot domain-fact-name (type SYMBOL))
  (slot domain-fact-idx (type INTEGER))
)

(deftemplate wm-sync-pair
  "Internal. What joins the facts of one wm-sync-map-fact."
  (slot domain-fact-name (type SYMBOL))
  (slot wm-fact-id (type STRING))
  ; --- the path of the key to which the predicate was mapped
  (multislot root (type SYMBOL))
  ; --- the domain-fact's parameters, and the same as one text
  (multislot param-values)
  (slot text (type STRING))
  ; --- value of the wm-fact when the two were last the same
  (slot wm-value)
)

(deftemplate wm-sync-atom
  "Internal. Stands for a domain-fact, for as long as that exists."
  (slot name (type SYMBOL))
  (multislot param-values)
  (slot text (type STRING))
  (slot fact (type FACT-ADDRESS))
  (slot idx (type INTEGER))
)

(deftemplate wm-sync-remap-fact
  "The facts of a predicate go by another path in the world model, for example
   `hardware gripper grasped` for the predicate holding. The arguments must have
   the names of the predicate's parameters. To be asserted before the facts."
  (slot domain-fact-name (type SYMBOL))
  (multislot wm-fact-key-path (type SYMBOL))
)

; *** What is known of objects ***

(deftemplate wm-sync-map-object-type
  "The wm-fact that lists the objects of one type."
  (slot domain-object-type (type SYMBOL))
  ; --- the wm-fact; index 0 before the first synchronisation
  (slot wm-fact-id (type STRING))
  (slot wm-fact-idx (type INTEGER))
  (multislot wm-fact-key (type SYMBOL))
)

(deftemplate wm-sync-object-list
  "Internal. The list for a type as it was last synchronised."
  (slot type (type SYMBOL))
  (multislot names)
)

(deftemplate wm-sync-object
  "Internal. A domain-object that the list of its type has."
  (slot type (type SYMBOL))
  (slot name)
)

(deftemplate wm-sync-remap-object-type
  "The list of a type's objects has another key. To be asserted before the type."
  (multislot wm-fact-key (type SYMBOL))
  (slot domain-object-type (type SYMBOL))
)

; *** Settings ***

(deffunction wm-sync-remap-fact-id-prefix ($?id-paths)
  "Map predicates to the IDs ?id-paths; the last part of an ID is the predicate.
   Example: (wm-sync-remap-fact-id-prefix \"/wm/holding\") for predicate holding.
   An ID with arguments is refused with an error message."
  (progn$ (?id ?id-paths)
    (bind ?key (wm-id-to-key ?id))
    (if (member$ args? ?key)
     then (printout error "Cannot remap ID prefix with arguments (" ?id ")" crlf)
     else (assert (wm-sync-remap-fact (wm-fact-key-path ?key)
                                      (domain-fact-name (nth$ (length$ ?key) ?key))))
    )
  )
)

(deffunction wm-sync-remap-object-id-prefix ($?id-paths)
  "Map object types to the IDs ?id-paths; the last part of an ID is the type."
  (progn$ (?id ?id-paths)
    (bind ?key (wm-id-to-key ?id))
    (assert (wm-sync-remap-object-type (wm-fact-key ?key)
                                       (domain-object-type (nth$ (length$ ?key) ?key))))
  )
)

(deffunction wm-sync-set-wm-fact-retract (?id ?enabled)
  "What happens to the wm-fact ?id when its domain-fact goes: it is retracted if
   ?enabled is TRUE, as is the rule; its value becomes FALSE otherwise."
  (do-for-fact ((?map wm-sync-map-fact)) (eq ?id ?map:wm-fact-id)
    (modify ?map (wm-fact-retract ?enabled))
  )
)

; *** Keys and parameters ***

(deffunction wm-sync-key-arg-values ($?key)
  "Argument values of a key in the key's order; FALSE and an error message if
   one of them is a list, which domain-facts cannot have."
  (bind ?mark (member$ args? ?key))
  (bind ?values (create$))
  (if ?mark then
    (loop-for-count (?i 1 (div (- (length$ ?key) ?mark) 2)) do
      (bind ?l (+ ?mark (* 2 ?i)))
      (bind ?value (nth$ ?l ?key))
      (if (and (eq ?value [) (< ?l (length$ ?key))) then
        (printout error "Domain predicates may not contain argument value list "
                        ?key crlf)
        (return FALSE))
      (bind ?values (create$ ?values ?value))))
  (return ?values)
)

(deffunction wm-sync-next-arg (?idx $?key)
  "Index of the argument name behind the one at ?idx, of the first one if ?idx
   is 0. Returns 0 at the end, -1 and an error message if the first is a list."
  (bind ?L (length$ ?key))
  (bind ?next (+ ?idx 2))
  (if (= ?idx 0) then
    (bind ?mark (member$ args? ?key))
    (if (not ?mark) then (return 0))
    (bind ?next (+ ?mark 1)))
  (if (>= ?next ?L) then (return 0))
  (if (and (= ?idx 0) (eq [ (nth$ (+ ?next 1) ?key))) then
    (printout error "Domain facts may not contain argument value list " ?key crlf)
    (return -1))
  (return ?next)
)

(deffunction wm-sync-args-match (?key ?param-names ?param-values)
  "TRUE if the key names each of the parameters, in any order, with its value,
   and nothing else."
  (bind ?matched 0)
  (bind ?l (wm-sync-next-arg 0 ?key))
  (while (> ?l 0) do
    (bind ?at (member$ (nth$ ?l ?key) ?param-names))
    (if (or (not ?at) (neq (nth$ ?at ?param-values) (nth$ (+ ?l 1) ?key))) then
      (return FALSE))
    (bind ?matched (+ ?matched 1))
    (bind ?l (wm-sync-next-arg ?l ?key))
  )
  (return (and (= ?l 0) (>= ?matched (length$ ?param-names))))
)

(deffunction wm-sync-remapped-path-match (?key ?key-path)
  "TRUE if ?key-path is the whole path of the key."
  (return (eq ?key-path (wm-key-path ?key)))
)

(deffunction wm-sync-remapped-pathargs-match (?key ?key-path ?param-names ?param-values)
  "TRUE if both the path and the arguments of the key are the given ones."
  (return (and (wm-sync-remapped-path-match ?key ?key-path)
               (wm-sync-args-match ?key ?param-names ?param-values)))
)

(deffunction wm-sync-text (?values)
  "Internal. Parameter values as one text. Values that look the same in an ID
   have the same text."
  (bind ?text "")
  (progn$ (?value ?values) (bind ?text (str-cat ?text "&" ?value)))
  (return ?text)
)

(deffunction wm-sync-key-param-values (?key ?param-names)
  "Internal. Values for a domain-fact from a key: in the order of the parameters
   where the key names just these, in the key's own order otherwise. FALSE and an
   error message if the key has a list."
  (bind ?values (wm-sync-key-arg-values ?key))
  (bind ?n (length$ ?param-names))
  (bind ?given (length$ (wm-key-args ?key)))
  (if (or (not (multifieldp ?values)) (< ?n 2) (<> ?given (+ 1 (* 2 ?n)))) then
    (return ?values))
  (bind ?ordered (create$))
  (progn$ (?name ?param-names)
    (bind ?l (wm-key-arg-idx ?key ?name))
    (if (not ?l) then (return ?values))
    (bind ?ordered (create$ ?ordered (nth$ (+ ?l 1) ?key)))
  )
  (return ?ordered)
)

(deffunction wm-sync-note-wm-fact (?id ?key ?root ?name ?param-names)
  "Internal. Note that the wm-fact ?id stands for a fact of predicate ?name."
  (bind ?values (wm-sync-key-param-values ?key ?param-names))
  (if (multifieldp ?values) then
    (assert (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id) (root ?root)
                          (param-values ?values) (text (wm-sync-text ?values)))))
)

(deffunction wm-sync-add-wm-fact (?atom ?root ?param-names)
  "Internal. Assert the wm-fact for the domain-fact of ?atom below path ?root."
  (bind ?name (fact-slot-value ?atom name))
  (bind ?values (fact-slot-value ?atom param-values))
  (bind ?args (domain-fact-args ?param-names ?values))
  (if (not (multifieldp ?args)) then (return))
  (bind ?key (create$ ?root ?args))
  (bind ?id (wm-key-to-id ?key))
  (assert (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id) (root ?root)
                        (param-values ?values) (wm-value TRUE)
                        (text (fact-slot-value ?atom text))))
  (bind ?wf (assert (wm-fact (id ?id) (key ?key) (type BOOL) (value TRUE))))
  (assert (wm-sync-map-fact (wm-fact-id ?id) (wm-fact-key ?key)
                            (wm-fact-idx (fact-index ?wf))
                            (domain-fact-name ?name)
                            (domain-fact-idx (fact-slot-value ?atom idx))))
)

; *** Remapping from the configuration ***
; Before the first addition, so that no fact is synchronised unmapped.

(deffunction wm-sync-config-prefix (?spec ?what)
  "Internal. Configuration path below which a spec has its remapping of ?what."
  (return (str-cat "/clips-executive/specs/" ?spec "/wm-remap/" ?what "/"))
)

(deffunction wm-sync-config-name (?path ?prefix)
  "Internal. What stands behind ?prefix in ?path, FALSE if it does not start so."
  (if (neq 1 (str-index ?prefix ?path)) then (return FALSE))
  (return (sym-cat (sub-string (+ 1 (str-length ?prefix)) (str-length ?path) ?path)))
)

(defrule wm-sync-config-remap-fact-id-prefix
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (executive-init)
  (confval (path "/clips-executive/spec") (type STRING) (value ?spec))
  ?cf <- (confval (type STRING) (is-list TRUE) (list-value $?ids)
                  (path ?path&:(eq ?path (str-cat (wm-sync-config-prefix ?spec facts)
                                                  "id-prefix"))))
  =>
  (wm-sync-remap-fact-id-prefix ?ids)
  (retract ?cf)
)

(defrule wm-sync-config-remap-fact-name-id
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (executive-init)
  (confval (path "/clips-executive/spec") (type STRING) (value ?spec))
  ?cf <- (confval (type STRING) (is-list FALSE) (value ?id)
                  (path ?path&:(wm-sync-config-name
                                 ?path (wm-sync-config-prefix ?spec "facts/name-id"))))
  =>
  (bind ?name (wm-sync-config-name ?path (wm-sync-config-prefix ?spec "facts/name-id")))
  (assert (wm-sync-remap-fact (domain-fact-name ?name)
                              (wm-fact-key-path (wm-id-to-key ?id))))
  (retract ?cf)
)

(defrule wm-sync-config-remap-object-id-prefix
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (executive-init)
  (confval (path "/clips-executive/spec") (type STRING) (value ?spec))
  ?cf <- (confval (type STRING) (is-list TRUE) (list-value $?ids)
                  (path ?path&:(eq ?path (str-cat (wm-sync-config-prefix ?spec objects)
                                                  "id-prefix"))))
  =>
  (wm-sync-remap-object-id-prefix ?ids)
  (retract ?cf)
)

(defrule wm-sync-config-remap-object-name-id
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (executive-init)
  (confval (path "/clips-executive/spec") (type STRING) (value ?spec))
  ?cf <- (confval (type STRING) (is-list FALSE) (value ?id)
                  (path ?path&:(wm-sync-config-name
                                 ?path (wm-sync-config-prefix ?spec "objects/name-id"))))
  =>
  (bind ?type (wm-sync-config-name ?path (wm-sync-config-prefix ?spec "objects/name-id")))
  (assert (wm-sync-remap-object-type (domain-object-type ?type)
                                     (wm-fact-key (wm-id-to-key ?id))))
  (retract ?cf)
)

; *** Facts: note what there is ***

(defrule wm-sync-note-domain-fact
  "A domain-fact is there. Its atom goes with it."
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (logical ?df <- (domain-fact (name ?name) (param-values $?values)))
  =>
  (assert (wm-sync-atom (name ?name) (param-values ?values)
                        (text (wm-sync-text ?values))
                        (fact ?df) (idx (fact-index ?df))))
)

(defrule wm-sync-note-worldmodel-fact
  "A wm-fact is there that stands for a fact of a declared predicate."
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (domain-predicate (name ?name) (param-names $?param-names))
  (not (wm-sync-remap-fact (domain-fact-name ?name)))
  (wm-fact (id ?id&~"") (key domain fact ?name $?rest))
  (not (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id)))
  =>
  (bind ?root (create$ domain fact ?name))
  (wm-sync-note-wm-fact ?id (create$ ?root ?rest) ?root ?name ?param-names)
)

(defrule wm-sync-note-worldmodel-fact-remapped
  "The same for a predicate that has another path."
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (domain-predicate (name ?name) (param-names $?param-names))
  (wm-sync-remap-fact (domain-fact-name ?name) (wm-fact-key-path ?head $?tail))
  (wm-fact (id ?id&~"")
           (key ?head $?rest&:(wm-sync-remapped-path-match ?rest ?tail)))
  (not (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id)))
  =>
  (bind ?root (create$ ?head ?tail))
  (wm-sync-note-wm-fact ?id (create$ ?head ?rest) ?root ?name ?param-names)
)

; *** Facts: deletions ***

(defrule wm-sync-domain-fact-removed
  "The domain-fact went: the wm-fact goes, or becomes FALSE."
  (declare (salience ?*SALIENCE-WM-SYNC-DEL*))
  ?pair <- (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id) (text ?text))
  ?map <- (wm-sync-map-fact (domain-fact-name ?name) (wm-fact-id ?id)
                            (domain-fact-idx ~0) (wm-fact-retract ?retract))
  (domain-predicate (name ?name))
  (not (wm-sync-atom (name ?name) (text ?text)))
  ?wf <- (wm-fact (id ?id) (value TRUE))
  =>
  (if ?retract
   then
    (modify ?map (domain-fact-idx 0) (wm-fact-idx 0))
    (retract ?wf)
   else
    (bind ?wf (modify ?wf (value FALSE)))
    (modify ?map (domain-fact-idx 0) (wm-fact-idx (fact-index ?wf)))
    (modify ?pair (wm-value FALSE)))
)

(defrule wm-sync-domain-fact-removed-wm-fact-not-true
  "The domain-fact went, and the wm-fact does not claim it any more."
  (declare (salience ?*SALIENCE-WM-SYNC-DEL*))
  ?pair <- (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id) (text ?text))
  ?map <- (wm-sync-map-fact (domain-fact-name ?name) (wm-fact-id ?id)
                            (domain-fact-idx ~0))
  (domain-predicate (name ?name))
  (not (wm-sync-atom (name ?name) (text ?text)))
  ?wf <- (wm-fact (id ?id) (value ?value&~TRUE))
  =>
  (modify ?map (domain-fact-idx 0) (wm-fact-idx (fact-index ?wf)))
  (modify ?pair (wm-value ?value))
)

(defrule wm-sync-worldmodel-fact-false
  "The wm-fact became FALSE: the domain-fact goes."
  (declare (salience ?*SALIENCE-WM-SYNC-DEL*))
  (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id) (text ?text) (wm-value ?last))
  (wm-sync-map-fact (domain-fact-name ?name) (wm-fact-id ?id)
                    (domain-fact-idx ~0) (wm-fact-idx ?wm-idx))
  (domain-predicate (name ?name))
  ?wf <- (wm-fact (id ?id) (type BOOL) (value FALSE))
  (test (or (neq ?last FALSE) (< ?wm-idx (fact-index ?wf))))
  (wm-sync-atom (name ?name) (text ?text) (fact ?df))
  =>
  (retract ?df)
)

(defrule wm-sync-worldmodel-fact-removed
  "The wm-fact went: the domain-fact goes."
  (declare (salience ?*SALIENCE-WM-SYNC-DEL*))
  (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id) (text ?text))
  (wm-sync-map-fact (domain-fact-name ?name) (wm-fact-id ?id)
                    (domain-fact-idx ~0) (wm-fact-idx ~0))
  (domain-predicate (name ?name))
  (not (wm-fact (id ?id)))
  (wm-sync-atom (name ?name) (text ?text) (fact ?df))
  =>
  (retract ?df)
)

; *** Facts: additions ***

(defrule wm-sync-domain-fact-added
  "A domain-fact without a wm-fact."
  (declare (salience ?*SALIENCE-WM-SYNC-ADD*))
  (domain-predicate (name ?name) (param-names $?param-names))
  (not (wm-sync-remap-fact (domain-fact-name ?name)))
  ?atom <- (wm-sync-atom (name ?name) (text ?text))
  (not (wm-sync-pair (domain-fact-name ?name) (text ?text) (root domain fact ?name)))
  =>
  (wm-sync-add-wm-fact ?atom (create$ domain fact ?name) ?param-names)
)

(defrule wm-sync-domain-fact-remapped-added
  "A domain-fact without a wm-fact, whose predicate has another path."
  (declare (salience ?*SALIENCE-WM-SYNC-ADD*))
  (domain-predicate (name ?name) (param-names $?param-names))
  (wm-sync-remap-fact (domain-fact-name ?name) (wm-fact-key-path $?root))
  ?atom <- (wm-sync-atom (name ?name) (text ?text))
  (not (wm-sync-pair (domain-fact-name ?name) (text ?text) (root $?root)))
  =>
  (wm-sync-add-wm-fact ?atom ?root ?param-names)
)

(defrule wm-sync-domain-fact-true
  "A domain-fact came back: the wm-fact, if it is FALSE, becomes TRUE."
  (declare (salience ?*SALIENCE-WM-SYNC-ADD*))
  ?pair <- (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id) (text ?text))
  ?map <- (wm-sync-map-fact (domain-fact-name ?name) (wm-fact-id ?id)
                            (domain-fact-idx ?idx))
  (domain-predicate (name ?name))
  (wm-sync-atom (name ?name) (text ?text) (idx ?new-idx&:(< ?idx ?new-idx)))
  ?wf <- (wm-fact (id ?id))
  =>
  (if (eq FALSE (fact-slot-value ?wf value)) then
    (bind ?wf (modify ?wf (value TRUE)))
    (modify ?pair (wm-value TRUE)))
  (modify ?map (domain-fact-idx ?new-idx) (wm-fact-idx (fact-index ?wf)))
)

(defrule wm-sync-worldmodel-fact-added
  "A wm-fact for the first time: there is a domain-fact, whatever the value."
  (declare (salience ?*SALIENCE-WM-SYNC-ADD*))
  ?pair <- (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id)
                         (param-values $?values))
  (not (wm-sync-map-fact (domain-fact-name ?name) (wm-fact-id ?id)))
  ?wf <- (wm-fact (id ?id) (key $?key))
  (domain-predicate (name ?name))
  =>
  (bind ?df (assert (domain-fact (name ?name) (param-values ?values))))
  (assert (wm-sync-map-fact (domain-fact-name ?name)
                            (domain-fact-idx (fact-index ?df))
                            (wm-fact-idx (fact-index ?wf))
                            (wm-fact-id ?id) (wm-fact-key ?key)))
  (modify ?pair (wm-value (fact-slot-value ?wf value)))
)

(defrule wm-sync-worldmodel-fact-true
  "The wm-fact became TRUE: there is a domain-fact."
  (declare (salience ?*SALIENCE-WM-SYNC-ADD*))
  ?pair <- (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id)
                         (param-values $?values) (wm-value ?last))
  ?map <- (wm-sync-map-fact (domain-fact-name ?name) (wm-fact-id ?id)
                            (domain-fact-idx 0) (wm-fact-idx ?wm-idx))
  (domain-predicate (name ?name))
  ?wf <- (wm-fact (id ?id) (type BOOL) (value TRUE))
  (test (or (neq ?last TRUE) (< ?wm-idx (fact-index ?wf))))
  =>
  (bind ?df (assert (domain-fact (name ?name) (param-values ?values))))
  (modify ?map (domain-fact-idx (fact-index ?df)) (wm-fact-idx (fact-index ?wf)))
  (modify ?pair (wm-value TRUE))
)

; *** Facts: forget ***

(defrule wm-sync-fact-cleanup
  "Both facts are gone."
  (declare (salience ?*SALIENCE-WM-SYNC-ADD*))
  ?pair <- (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id) (text ?text))
  ?map <- (wm-sync-map-fact (domain-fact-name ?name) (wm-fact-id ?id))
  (domain-predicate (name ?name))
  (not (wm-fact (id ?id)))
  (not (wm-sync-atom (name ?name) (text ?text)))
  =>
  (retract ?map ?pair)
)

(defrule wm-sync-fact-cleanup-domain-fact-back
  "Both facts were gone, and the domain-fact is back: it counts as a new one."
  (declare (salience ?*SALIENCE-WM-SYNC-DEL*))
  ?pair <- (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id) (text ?text))
  ?map <- (wm-sync-map-fact (domain-fact-name ?name) (wm-fact-id ?id)
                            (domain-fact-idx 0))
  (wm-sync-atom (name ?name) (text ?text))
  (not (wm-fact (id ?id)))
  =>
  (retract ?map ?pair)
)

(defrule wm-sync-pair-cleanup
  "The wm-fact went before there was anything to keep the same."
  (declare (salience ?*SALIENCE-WM-SYNC-DEL*))
  ?pair <- (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id))
  (not (wm-sync-map-fact (domain-fact-name ?name) (wm-fact-id ?id)))
  (not (wm-fact (id ?id)))
  =>
  (retract ?pair)
)

; *** Objects ***

(deffunction wm-sync-set-object-list (?map ?wf ?list ?names)
  "Internal. Make ?names the value of the wm-fact, and remember that."
  (bind ?wf (modify ?wf (values ?names)))
  (modify ?list (names ?names))
  (modify ?map (wm-fact-idx (fact-index ?wf)))
)

(deffunction wm-sync-map-object-type (?type ?key)
  "Internal. List the objects of ?type in the wm-fact with the key ?key."
  (assert (wm-sync-object-list (type ?type))
          (wm-sync-map-object-type (domain-object-type ?type) (wm-fact-key ?key)
                                   (wm-fact-id (wm-key-to-id ?key))))
)

(defrule wm-sync-domain-object-type-added
  (declare (salience ?*SALIENCE-WM-SYNC-ADD*))
  (domain-object-type (name ?type))
  (not (wm-sync-remap-object-type (domain-object-type ?type)))
  (not (wm-sync-map-object-type (domain-object-type ?type)))
  =>
  (wm-sync-map-object-type ?type (create$ domain objects-by-type ?type))
)

(defrule wm-sync-domain-object-type-remapped-added
  (declare (salience ?*SALIENCE-WM-SYNC-DEL*))
  (domain-object-type (name ?type))
  (wm-sync-remap-object-type (domain-object-type ?type) (wm-fact-key $?key))
  (not (wm-sync-map-object-type (domain-object-type ?type)))
  =>
  (wm-sync-map-object-type ?type ?key)
)

(defrule wm-sync-domain-object-mapping-added
  "The list is missing: it is empty at first. If it was there before, somebody
   retracted it, and this counts as a change to the empty list."
  (declare (salience ?*SALIENCE-WM-SYNC-ADD*))
  ?map <- (wm-sync-map-object-type (wm-fact-id ?id) (wm-fact-key $?key) (wm-fact-idx ?idx))
  (not (wm-fact (id ?id)))
  =>
  (bind ?wf (assert (wm-fact (id ?id) (key ?key) (type SYMBOL) (is-list TRUE))))
  (modify ?map (wm-fact-idx (fact-index ?wf)))
)

(defrule wm-sync-domain-object-added
  "A domain-object that its list lacks."
  (declare (salience ?*SALIENCE-WM-SYNC-ADD*))
  (domain-object (name ?name) (type ?type))
  ?map <- (wm-sync-map-object-type (domain-object-type ?type) (wm-fact-id ?id))
  ?list <- (wm-sync-object-list (type ?type))
  (not (wm-sync-object (type ?type) (name ?name)))
  ?wf <- (wm-fact (id ?id) (type SYMBOL) (is-list TRUE))
  =>
  (assert (wm-sync-object (type ?type) (name ?name)))
  (wm-sync-set-object-list ?map ?wf ?list
                           (create$ (fact-slot-value ?wf values) ?name))
)

(defrule wm-sync-domain-object-removed
  "A domain-object went. A list that was changed as well is left to the next rule."
  (declare (salience ?*SALIENCE-WM-SYNC-DEL*))
  ?object <- (wm-sync-object (type ?type) (name ?name))
  (not (domain-object (name ?name) (type ?type)))
  ?map <- (wm-sync-map-object-type (domain-object-type ?type) (wm-fact-id ?id))
  ?list <- (wm-sync-object-list (type ?type))
  ?wf <- (wm-fact (id ?id) (type SYMBOL) (is-list TRUE))
  =>
  (retract ?object)
  (bind ?names (fact-slot-value ?wf values))
  (if (eq ?names (fact-slot-value ?list names)) then
    (wm-sync-set-object-list ?map ?wf ?list (delete-member$ ?names ?name)))
)

(defrule wm-sync-worldmodel-objects-changed
  "Somebody changed the list: the domain-objects become what it says."
  (declare (salience ?*SALIENCE-WM-SYNC-DEL*))
  ?map <- (wm-sync-map-object-type (domain-object-type ?type) (wm-fact-id ?id))
  ?list <- (wm-sync-object-list (type ?type) (names $?before))
  ?wf <- (wm-fact (id ?id) (type SYMBOL) (is-list TRUE) (values $?names&~$?before))
  =>
  (delayed-do-for-all-facts ((?object domain-object))
      (and (eq ?type ?object:type) (not (member$ ?object:name ?names)))
    (retract ?object)
  )
  (delayed-do-for-all-facts ((?noted wm-sync-object))
      (and (eq ?type ?noted:type) (not (member$ ?noted:name ?names)))
    (retract ?noted)
  )
  (progn$ (?name ?names)
    (assert (domain-object (name ?name) (type ?type))
            (wm-sync-object (type ?type) (name ?name)))
  )
  (modify ?list (names ?names))
  (modify ?map (wm-fact-idx (fact-index ?wf)))
)
