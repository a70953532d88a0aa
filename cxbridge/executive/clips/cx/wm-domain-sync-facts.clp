; Synchronises wm-facts and domain-facts; wm-domain-sync.clp describes the method.
;
; Needs wm-domain-sync.clp.

(deftemplate wm-sync-pair
  "Internal. The data for joins between the facts of a wm-sync-map-fact."
  (slot domain-fact-name (type SYMBOL))
  (slot wm-fact-id (type STRING))
  ; --- the path of the key to which the predicate is mapped
  (multislot root (type SYMBOL))
  ; --- the domain-fact's parameter values, and the same as a text (wm-sync-text)
  (multislot param-values)
  (slot text (type STRING))
  ; --- the value of the wm-fact at the last synchronisation
  (slot wm-value)
)

(deftemplate wm-sync-atom
  "Internal. A domain-fact, with its parameter values as a text, while it exists."
  (slot name (type SYMBOL))
  (multislot param-values)
  (slot text (type STRING))
  ; --- the fact address and the fact index of the domain-fact
  (slot fact (type FACT-ADDRESS))
  (slot idx (type INTEGER))
)

; *** Functions ***

(deffunction wm-sync-text (?values)
  "Internal. The parameter values as a text. Values that have the same spelling in an
   ID have the same text."
  (bind ?text "")
  (progn$ (?value ?values) (bind ?text (str-cat ?text "&" ?value)))
  (return ?text)
)

(deffunction wm-sync-key-param-values (?key ?param-names)
  "Internal. The values of a key for a domain-fact: in the order of the parameters if
   the key names exactly these, or else in the order of the key. FALSE and an error
   message if the key has a list."
  (bind ?values (wm-sync-key-arg-values ?key))
  (bind ?param-count (length$ ?param-names))
  (bind ?arg-elements (length$ (wm-key-args ?key)))
  ; Nothing to order: a list, fewer than two parameters, or not exactly one name and value for each
  ; parameter after args?.
  (if (or (not (multifieldp ?values)) (< ?param-count 2) (<> ?arg-elements (+ 1 (* 2 ?param-count)))) then
    (return ?values))
  (bind ?ordered (create$))
  (progn$ (?name ?param-names)
    (bind ?name-idx (wm-key-arg-idx ?key ?name))
    (if (not ?name-idx) then (return ?values))
    (bind ?ordered (create$ ?ordered (nth$ (+ ?name-idx 1) ?key)))
  )
  (return ?ordered)
)

(deffunction wm-sync-note-wm-fact (?id ?key ?root ?name ?param-names)
  "Internal. Assert that the wm-fact ?id, with the path ?root in its key, corresponds to a
   domain-fact of the predicate ?name."
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

; *** Facts: index the present facts ***

(defrule wm-sync-note-domain-fact
  "Assert the atom of a domain-fact, with logical support by the domain-fact."
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (logical ?df <- (domain-fact (name ?name) (param-values $?values)))
  =>
  (assert (wm-sync-atom (name ?name) (param-values ?values)
                        (text (wm-sync-text ?values))
                        (fact ?df) (idx (fact-index ?df))))
)

(defrule wm-sync-note-worldmodel-fact
  "A new wm-fact corresponds to a fact of a declared predicate."
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (domain-predicate (name ?name) (param-names $?param-names))
  (not (wm-sync-remap-fact (domain-fact-name ?name)))
  (wm-fact (id ?id&~"") (key domain fact ?name $?args))
  (not (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id)))
  =>
  (bind ?root (create$ domain fact ?name))
  (wm-sync-note-wm-fact ?id (create$ ?root ?args) ?root ?name ?param-names)
)

(defrule wm-sync-note-worldmodel-fact-remapped
  "A new wm-fact corresponds to a fact of a declared predicate with another path."
  (declare (salience ?*SALIENCE-WM-IDKEY*))
  (domain-predicate (name ?name) (param-names $?param-names))
  (wm-sync-remap-fact (domain-fact-name ?name) (wm-fact-key-path ?head $?tail))
  (wm-fact (id ?id&~"")
           (key ?head $?after-head&:(wm-sync-remapped-path-match ?after-head ?tail)))
  (not (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id)))
  =>
  (bind ?root (create$ ?head ?tail))
  (wm-sync-note-wm-fact ?id (create$ ?head ?after-head) ?root ?name ?param-names)
)

; *** Facts: deletions ***

(defrule wm-sync-domain-fact-removed
  "The domain-fact was retracted: retract the wm-fact, or set it to FALSE."
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
  "The domain-fact was retracted, and the wm-fact is not TRUE: only note the new state."
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
  "The wm-fact became FALSE: retract the domain-fact."
  (declare (salience ?*SALIENCE-WM-SYNC-DEL*))
  (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id) (text ?text) (wm-value ?last))
  (wm-sync-map-fact (domain-fact-name ?name) (wm-fact-id ?id)
                    (domain-fact-idx ~0) (wm-fact-idx ?wm-idx))
  (domain-predicate (name ?name))
  ?wf <- (wm-fact (id ?id) (type BOOL) (value FALSE))
  ; the wm-fact differs from its state at the last synchronisation: in its value or in its index
  (test (or (neq ?last FALSE) (< ?wm-idx (fact-index ?wf))))
  (wm-sync-atom (name ?name) (text ?text) (fact ?df))
  =>
  (retract ?df)
)

(defrule wm-sync-worldmodel-fact-removed
  "The wm-fact was retracted: retract the domain-fact."
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
  "Assert the wm-fact of a new domain-fact."
  (declare (salience ?*SALIENCE-WM-SYNC-ADD*))
  (domain-predicate (name ?name) (param-names $?param-names))
  (not (wm-sync-remap-fact (domain-fact-name ?name)))
  ?atom <- (wm-sync-atom (name ?name) (text ?text))
  (not (wm-sync-pair (domain-fact-name ?name) (text ?text) (root domain fact ?name)))
  =>
  (wm-sync-add-wm-fact ?atom (create$ domain fact ?name) ?param-names)
)

(defrule wm-sync-domain-fact-remapped-added
  "Assert the wm-fact of a new domain-fact whose predicate has another path."
  (declare (salience ?*SALIENCE-WM-SYNC-ADD*))
  (domain-predicate (name ?name) (param-names $?param-names))
  (wm-sync-remap-fact (domain-fact-name ?name) (wm-fact-key-path $?root))
  ?atom <- (wm-sync-atom (name ?name) (text ?text))
  (not (wm-sync-pair (domain-fact-name ?name) (text ?text) (root $?root)))
  =>
  (wm-sync-add-wm-fact ?atom ?root ?param-names)
)

(defrule wm-sync-domain-fact-true
  "A domain-fact was asserted again: set the wm-fact to TRUE if it is FALSE."
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
  "A new wm-fact, of any value: assert its domain-fact."
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
  "The wm-fact became TRUE: assert its domain-fact."
  (declare (salience ?*SALIENCE-WM-SYNC-ADD*))
  ?pair <- (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id)
                         (param-values $?values) (wm-value ?last))
  ?map <- (wm-sync-map-fact (domain-fact-name ?name) (wm-fact-id ?id)
                            (domain-fact-idx 0) (wm-fact-idx ?wm-idx))
  (domain-predicate (name ?name))
  ?wf <- (wm-fact (id ?id) (type BOOL) (value TRUE))
  ; as in wm-sync-worldmodel-fact-false
  (test (or (neq ?last TRUE) (< ?wm-idx (fact-index ?wf))))
  =>
  (bind ?df (assert (domain-fact (name ?name) (param-values ?values))))
  (modify ?map (domain-fact-idx (fact-index ?df)) (wm-fact-idx (fact-index ?wf)))
  (modify ?pair (wm-value TRUE))
)

; *** Facts: clean-up ***

(defrule wm-sync-fact-cleanup
  "Both facts were retracted: forget the pair."
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
  "Both facts were retracted, and the domain-fact was asserted again: forget the pair, so that the
   domain-fact counts as new."
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
  "The wm-fact was retracted before its first synchronisation."
  (declare (salience ?*SALIENCE-WM-SYNC-DEL*))
  ?pair <- (wm-sync-pair (domain-fact-name ?name) (wm-fact-id ?id))
  (not (wm-sync-map-fact (domain-fact-name ?name) (wm-fact-id ?id)))
  (not (wm-fact (id ?id)))
  =>
  (retract ?pair)
)
