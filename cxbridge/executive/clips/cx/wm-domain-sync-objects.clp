; Keeps the domain-objects of each type and the wm-fact that lists them the same.
;
; A wm-sync-object marks each object that the list has, so that a missing one is
; found by look-up. What came and went is collected first, and the list is written
; once. A list that differs from the wm-sync-object-list was changed by somebody
; else, who then decides which objects there are.
;
; Every modify makes CLIPS join the fact anew with all that it matches. Hence the
; facts that are modified here are never joined with all objects of a type; that is
; what wm-sync-listed-type is for.
;
; Needs wm-domain-sync.clp.

(deftemplate wm-sync-listed-type
  "Internal. There is a list for the type."
  (slot type (type SYMBOL))
)

(deftemplate wm-sync-object-list
  "Internal. The list for a type as it was last synchronised."
  (slot type (type SYMBOL))
  (multislot names)
)

(deftemplate wm-sync-object
  "Internal. A domain-object that the list of its type has or is to have."
  (slot type (type SYMBOL))
  (slot name)
)

(deftemplate wm-sync-object-change
  "Internal. An object that is to be put into the list of its type, or taken out."
  (slot type (type SYMBOL))
  (slot name)
  (slot what (type SYMBOL) (allowed-values ADD REMOVE))
)

(deffunction wm-sync-map-object-type (?type ?key)
  "Internal. List the objects of ?type in the wm-fact with the key ?key."
  (assert (wm-sync-listed-type (type ?type))
          (wm-sync-object-list (type ?type))
          (wm-sync-map-object-type (domain-object-type ?type) (wm-fact-key ?key)
                                   (wm-fact-id (wm-key-to-id ?key))))
)

(deffunction wm-sync-apply-object-changes (?type ?names)
  "Internal. The list ?names with all collected changes, which are forgotten."
  (do-for-all-facts ((?change wm-sync-object-change)) (eq ?type ?change:type)
    (bind ?names (if (eq ?change:what ADD)
                  then (create$ ?names ?change:name)
                  else (delete-member$ ?names ?change:name)))
  )
  (delayed-do-for-all-facts ((?change wm-sync-object-change)) (eq ?type ?change:type)
    (retract ?change)
  )
  (return ?names)
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
  (wm-sync-listed-type (type ?type))
  (domain-object (name ?name) (type ?type))
  (not (wm-sync-object (type ?type) (name ?name)))
  =>
  (assert (wm-sync-object (type ?type) (name ?name))
          (wm-sync-object-change (type ?type) (name ?name) (what ADD)))
)

(defrule wm-sync-domain-object-removed
  "A domain-object went that its list has."
  (declare (salience ?*SALIENCE-WM-SYNC-DEL*))
  ?object <- (wm-sync-object (type ?type) (name ?name))
  (not (domain-object (name ?name) (type ?type)))
  (not (wm-sync-object-change (type ?type) (name ?name) (what ADD)))
  =>
  (retract ?object)
  (assert (wm-sync-object-change (type ?type) (name ?name) (what REMOVE)))
)

(defrule wm-sync-domain-object-not-added
  "A domain-object went before its list had it."
  (declare (salience ?*SALIENCE-WM-SYNC-DEL*))
  ?object <- (wm-sync-object (type ?type) (name ?name))
  (not (domain-object (name ?name) (type ?type)))
  ?change <- (wm-sync-object-change (type ?type) (name ?name) (what ADD))
  =>
  (retract ?object ?change)
)

(defrule wm-sync-domain-objects-listed
  "All changes are collected: write the list."
  (declare (salience (- ?*SALIENCE-WM-SYNC-ADD* 1)))
  (wm-sync-listed-type (type ?type))
  (exists (wm-sync-object-change (type ?type)))
  ?list <- (wm-sync-object-list (type ?type) (names $?names))
  ?map <- (wm-sync-map-object-type (domain-object-type ?type) (wm-fact-id ?id))
  ?wf <- (wm-fact (id ?id) (type SYMBOL) (is-list TRUE))
  =>
  (bind ?names (wm-sync-apply-object-changes ?type ?names))
  (bind ?wf (modify ?wf (values ?names)))
  (modify ?list (names ?names))
  (modify ?map (wm-fact-idx (fact-index ?wf)))
)

(defrule wm-sync-worldmodel-objects-changed
  "Somebody changed the list: the domain-objects become what it says, whatever
   happened to them."
  (declare (salience ?*SALIENCE-WM-SYNC-DEL*))
  ?map <- (wm-sync-map-object-type (domain-object-type ?type) (wm-fact-id ?id))
  ?list <- (wm-sync-object-list (type ?type) (names $?before))
  ?wf <- (wm-fact (id ?id) (type SYMBOL) (is-list TRUE) (values $?names&~$?before))
  =>
  (wm-sync-apply-object-changes ?type ?before)
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
