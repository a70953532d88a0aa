; Keeps the domain-objects of each type and the wm-fact that lists them the same.
;
; A wm-sync-object marks each object that the list has, so that a missing one is
; found by look-up; a list that differs from the wm-sync-object-list was changed
; by somebody else, who then decides which objects there are.
;
; Needs wm-domain-sync.clp.

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
